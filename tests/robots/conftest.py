"""LeRobot's commands, run for real in this process, which has imported LeRobot already."""

import logging
import sys
from collections.abc import Callable

import pytest

RunCommand = Callable[..., None]


@pytest.fixture
def logging_is_restored():
    """LeRobot's commands replace the handlers of the root logger."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    yield
    root.setLevel(level)
    root.handlers[:] = handlers


@pytest.fixture
def run_command(monkeypatch, tmp_path, logging_is_restored):
    """Run a command on the dataset `data`, with the session log `session.jsonl`."""

    def _run(main, *arguments):
        common = [
            f"--robot.calibration_dir={tmp_path}",
            f"--robot.session_log={tmp_path / 'session.jsonl'}",
            "--dataset.repo_id=someone/data",
            f"--dataset.root={tmp_path / 'data'}",
            "--play_sounds=false",
        ]
        monkeypatch.setattr(sys, "argv", ["command", *common, *arguments])
        main()

    return _run
