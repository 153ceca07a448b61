"""What was run to make a result: `RESULT.json` beside it, and its output in `RESULT.log`."""

import json
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, field, fields
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.experiment.stage import partial_path

PACKAGES = ("lerobot_env_excav", "lerobot", "torch", "mujoco", "numpy")


@dataclass(frozen=True, kw_only=True)
class StageRecord:
    """Command, code and time of a stage.

    Attributes:
        stage: Name of the stage.
        command: The command that began the result, for bash.
        environment: Variables that the experiment gave it.
        commit: Commit of this repository; None outside of one.
        modified: Whether the package differed from that commit.
        packages: Versions by distribution.
        attempts: Of every run: `started` (UTC), `wall_s`, `exit_code`.
        needs: When the results that it was made from were `made`, by their stages; without those made by hand.
        training: How the policy of an evaluation had been trained when it began; None for other stages.
    """

    stage: str
    command: str
    environment: Mapping[str, str]
    commit: str | None
    modified: bool
    packages: Mapping[str, str]
    attempts: Sequence[Mapping[str, Any]] = field(default_factory=list)
    needs: Mapping[str, str] = field(default_factory=dict)
    training: Mapping[str, Any] | None = None

    @property
    def made(self) -> str | None:
        """Start of the last run (UTC), which tells results of one name apart; None if none has ended."""
        return str(self.attempts[-1]["started"]) if self.attempts else None

    @property
    def wall_s(self) -> float:
        """Time of all runs [s]."""
        return float(sum(attempt["wall_s"] for attempt in self.attempts))

    def write(self, makes: Path) -> None:
        """Write the record of a result."""
        path = record_path(makes)
        partial = partial_path(path)
        partial.write_text(json.dumps(asdict(self), indent=1) + "\n")
        partial.replace(path)


def record_path(makes: Path) -> Path:
    """Return where the record of a result lies."""
    return makes.with_name(f"{makes.name}.json")


def log_path(makes: Path) -> Path:
    """Return where the output of a result's command lies."""
    return makes.with_name(f"{makes.name}.log")


def read_record(makes: Path) -> StageRecord | None:
    """Read the record of a result; None if it has none, as when its command was run by hand.

    Raises:
        DatasetError: The file in its place is none.
    """
    path = record_path(makes)
    return record_from(read_json(path), path) if path.is_file() else None


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        DatasetError: The file holds none.
    """
    try:
        content = json.loads(path.read_text())
    except ValueError as error:
        raise DatasetError(f"{path} is damaged ({error}); remove it, what lies beside it is kept") from error
    if not isinstance(content, dict):
        raise DatasetError(f"{path} holds no JSON object; move it elsewhere")
    return content


def record_from(content: Mapping[str, Any], path: Path) -> StageRecord:
    """Make a record of what was read from a file.

    Raises:
        DatasetError: It is something else.
    """
    entries = fields(StageRecord)
    # Records of earlier versions lack what has a default.
    missing = {entry.name for entry in entries if entry.default is entry.default_factory is MISSING} - set(
        content
    )
    unlike = sorted(missing | set(content) - {entry.name for entry in entries})
    if unlike:
        raise DatasetError(
            f"{path} is no record of a stage, by its entries {', '.join(unlike)}; move it elsewhere: its name "
            "is kept for the record of what lies beside it"
        )
    return StageRecord(**content)


def new_record(
    stage: str,
    command: str,
    environment: Mapping[str, str],
    *,
    needs: Mapping[str, str],
    training: Mapping[str, Any] | None,
) -> StageRecord:
    """Describe a command that is about to be run."""
    commit, modified = _code()
    return StageRecord(
        stage=stage,
        command=command,
        environment=dict(environment),
        commit=commit,
        modified=modified,
        packages={name: version(name) for name in PACKAGES},
        needs=dict(needs),
        training=training,
    )


def attempt(started: datetime, *, wall_s: float, exit_code: int) -> dict[str, Any]:
    """Describe one run of a command."""
    text = started.astimezone(UTC).isoformat(timespec="milliseconds")
    return {"started": text, "wall_s": round(wall_s, 1), "exit_code": exit_code}


def _code() -> tuple[str | None, bool]:
    """Return the commit of the package's repository, and whether the package differs from it."""
    package = Path(__file__).parents[2]
    if not _git(package, "ls-files", "--error-unmatch", "__init__.py"):
        return None, False  # installed, perhaps within the repository of something else
    commit = _git(package, "rev-parse", "HEAD")
    changes = _git(package, "status", "--porcelain", "--", ".")
    return commit or None, bool(changes)


def _git(folder: Path, *arguments: str) -> str:
    """Return git's answer; an empty one where there is no git, or no repository."""
    try:
        done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
