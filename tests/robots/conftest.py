"""LeRobot's commands, run for real in this process, which has imported LeRobot already."""

import logging
import sys

import pytest


@pytest.fixture
def run_command(monkeypatch, tmp_path):
    """Run a command on the dataset `data`, with the session log `session.jsonl`."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)

    def _run(main, *arguments):
        log, data = tmp_path / "session.jsonl", tmp_path / "data"
        robot = (f"--robot.calibration_dir={tmp_path}", f"--robot.session_log={log}", "--play_sounds=false")
        dataset = ("--dataset.repo_id=someone/data", f"--dataset.root={data}")
        monkeypatch.setattr(sys, "argv", ["command", *robot, *dataset, *arguments])
        main()

    yield _run
    # LeRobot's commands replace the handlers of the root logger.
    root.setLevel(level)
    root.handlers[:] = handlers
