"""LeRobot's commands, run for real in this process, which has imported LeRobot already."""

import logging
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

RunCommand = Callable[..., None]


@pytest.fixture
def logging_is_restored() -> Iterator[None]:
    """LeRobot's commands replace the handlers of the root logger."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    yield
    root.setLevel(level)
    root.handlers[:] = handlers


@pytest.fixture
def run_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, logging_is_restored: None) -> RunCommand:
    """Run a command on the dataset `data`, with the session log `session.jsonl`."""

    def _run(main: Callable[[], None], *arguments: str) -> None:
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
