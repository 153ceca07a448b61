"""Running a stage once."""

import fcntl
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.experiment.stage import Stage
from lerobot_excav.evaluation.experiment.stage_record import (
    StageRecord,
    attempt,
    new_record,
    read_record,
    record_path,
)
from lerobot_excav.evaluation.training import evaluated_training

PATIENCE_S = 20.0
"""How long a stopped command may take to end before it is killed [s]; a guess."""


class StageRun:
    """A stage's command at work, its output in the stage's log.

    Args:
        stage: What to run; nothing may lie at its result.
        environment: Variables for the command, beside those of this process.
        output: The stage's log from `lock_log`; held until the result is in place.
        needs: When the results that it works on were made, by their stages.
    """

    def __init__(
        self, stage: Stage, environment: Mapping[str, str], output: IO[str], *, needs: Mapping[str, str]
    ) -> None:
        self.stage = stage
        self.log = Path(output.name)
        self._output = output
        self._command = stage.next_command
        self._environment = environment
        self._needs = needs
        if not stage.goes_on:
            self._clear()
        self._started, self._clock = datetime.now(UTC), time.monotonic()
        output.write(f"\n# {self._started:%Y-%m-%d %H:%M:%S} UTC\n{self._command}\n\n")
        output.flush()
        self._said_from = output.tell()
        self._record_start()
        self._process = _start(self._command, environment, output)

    def _clear(self) -> None:
        """Begin anew: what an earlier run has left and said belongs to no result."""
        self._output.seek(0)
        self._output.truncate()
        if self.stage.workspace != self.stage.makes:
            shutil.rmtree(str(self.stage.workspace), ignore_errors=True)

    def _record_start(self) -> None:
        """Tell the command before it runs: if this process is killed, the next one must know what began the result."""
        makes = self.stage.makes
        if makes is not None and not (self.stage.goes_on and record_path(makes).is_file()):
            self._new_record().write(makes)

    def _new_record(self) -> StageRecord:
        # Read before the command reads it: a training may go on, or be made anew, while its policy plays.
        training = evaluated_training(self._command)
        return new_record(
            self.stage.name,
            self._command,
            self._environment,
            needs=self._needs,
            training=training.as_dict() if training else None,
        )

    @property
    def exit_code(self) -> int | None:
        """Exit code of the command; None while it runs."""
        return self._process.poll()

    @property
    def wall_s(self) -> float:
        """Time since the start [s]."""
        return time.monotonic() - self._clock

    def output(self) -> str:
        """Return what the command has said."""
        with self.log.open() as file:
            file.seek(self._said_from)
            return file.read()

    def stop(self) -> None:
        """End the command, with all processes it has started, and wait for it."""
        if self._process.poll() is None:
            _signal(self._process, signal.SIGTERM)
            try:
                self._process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                _signal(self._process, signal.SIGKILL)
                self._process.wait()

    def finish(self) -> bool:
        """Write the record of an ended command and put its result in place; return whether it succeeded."""
        exit_code = self._process.wait()
        with self._output:
            return self._keep(exit_code)

    def _keep(self, exit_code: int) -> bool:
        succeeded = exit_code == 0
        makes, workspace = self.stage.makes, self.stage.workspace
        if makes is None or workspace is None:
            return succeeded
        record = read_record(makes) or self._new_record()
        run = attempt(self._started, wall_s=self.wall_s, exit_code=exit_code)
        replace(record, attempts=[*record.attempts, run]).write(makes)
        if not succeeded or not workspace.exists():
            return False
        if workspace != makes:
            workspace.rename(makes)
        return True


def lock_log(log: Path, name: str) -> IO[str]:
    """Open the log of a stage and hold it alone.

    A command that writes to it inherits the lock: it holds until the file is closed and the command has ended.

    Args:
        log: The log.
        name: Name of the stage.

    Raises:
        ConfigurationError: Another process is at the stage.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    output = log.open("a")
    try:
        fcntl.flock(output, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        output.close()
        raise ConfigurationError(
            f"another process is at stage {name}, by the lock on {log}; wait for it, or end it"
        ) from None
    return output


def _start(command: str, environment: Mapping[str, str], output: IO[str]) -> "subprocess.Popen[bytes]":
    # The commands are installed beside this Python, whether its environment is activated or not.
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    return subprocess.Popen(
        ["bash", "-euo", "pipefail", "-c", command],
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PATH": path, **environment},
        start_new_session=True,
    )


def _signal(process: "subprocess.Popen[bytes]", number: int) -> None:
    """Signal a command and what it has started: they form a session of their own."""
    os.killpg(process.pid, number)
