"""One stage of an experiment: a command that makes a folder."""

import shlex
import textwrap
from dataclasses import dataclass
from pathlib import Path

PARTIAL_SUFFIX = ".partial"

_LINE_LENGTH = 110


@dataclass(frozen=True, kw_only=True)
class Resumption:
    """How a command is continued.

    Attributes:
        command: The command.
        source: File of the unfinished result that it continues from; without it the stage begins anew.
    """

    command: str
    source: Path


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A command, and what it makes.

    Attributes:
        name: Name within the experiment.
        command: The command, a line for bash; it works on `workspace`.
        makes: What exists once the stage is finished. None: the stage is never finished and runs every time.
        needs: Names of the stages that must be finished before.
        appears_whole: Whether the command itself lets its result appear at once, and continues after an interruption.
        resumption: How an interrupted command is continued; None begins anew.
    """

    name: str
    command: str
    makes: Path | None = None
    needs: tuple[str, ...] = ()
    appears_whole: bool = False
    resumption: Resumption | None = None

    @property
    def is_finished(self) -> bool:
        """Whether the result is there, whoever made it."""
        return self.makes is not None and self.makes.exists()

    @property
    def workspace(self) -> Path | None:
        """Where the command works: beside the result, unless that appears whole anyway."""
        return workspace_of(self.makes, appears_whole=self.appears_whole)

    @property
    def is_started(self) -> bool:
        """Whether an interrupted run has left something."""
        return self.makes is not None and partial_path(self.makes).exists()

    @property
    def resumes(self) -> bool:
        """Whether the next run continues the last one."""
        return self.resumption is not None and self.resumption.source.exists()

    @property
    def goes_on(self) -> bool:
        """Whether the next run adds to what the last one has left; else it begins anew."""
        return self.resumes or (self.appears_whole and self.is_started)

    @property
    def next_command(self) -> str:
        """The command of the next run."""
        return self.resumption.command if self.resumption and self.resumes else self.command

    def shell_lines(self) -> list[str]:
        """Return what the next run does, as commands for bash of which each needs the one before."""
        command = _wrapped(self.next_command)
        if self.makes is None or self.workspace == self.makes:
            return [command]
        clear = [] if self.resumes else [f"rm -rf {shlex.quote(str(self.workspace))}"]
        return [*clear, command, shlex.join(["mv", str(self.workspace), str(self.makes)])]


def _wrapped(command: str) -> str:
    """Break a long command between its words, unless quotes make that unsafe."""
    if "'" in command or '"' in command:
        return command
    lines = textwrap.wrap(command, _LINE_LENGTH, break_long_words=False, break_on_hyphens=False)
    return " \\\n  ".join(lines)


def partial_path(makes: Path) -> Path:
    """Return the name of a result until it is complete."""
    return makes.with_name(makes.name + PARTIAL_SUFFIX)


def workspace_of(makes: Path | None, *, appears_whole: bool) -> Path | None:
    """Return where a command works that makes something.

    Args:
        makes: What it makes.
        appears_whole: Whether it lets its result appear at once.
    """
    return makes if makes is None or appears_whole else partial_path(makes)
