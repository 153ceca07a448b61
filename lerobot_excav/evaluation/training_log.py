"""What the log of a training tells: its command, its code, and how long it took.

LeRobot prints times; a workflow adds two lines before its output: `$ COMMAND` and `# commit COMMIT`.
"""

import re
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

_COMMAND = re.compile(r"^\$ (.+)$", re.MULTILINE)
_COMMIT = re.compile(r"^# commit (\S+)$", re.MULTILINE)
_LINE = re.compile(
    r"INFO (?P<time>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) \S+ "
    r"(?:(?P<start>Start offline training)|Checkpoint policy after step (?P<step>\d+))"
)


@dataclass(frozen=True, kw_only=True)
class TrainingLog:
    """Command and commit of a training, those of its first command, or None; minutes to each checkpoint by its step."""

    command: str | None = None
    commit: str | None = None
    minutes: dict[int, float] = field(default_factory=dict)


def read_training_log(log: Path) -> TrainingLog:
    """Read what the runs of a training printed, one after the other; a missing file tells nothing."""
    if not log.is_file():
        return TrainingLog()
    text = log.read_text(encoding="utf-8", errors="replace")
    command, commit = _COMMAND.search(text), _COMMIT.search(text)
    return TrainingLog(
        command=command[1] if command else None, commit=commit[1] if commit else None, minutes=_minutes(text)
    )


def _minutes(text: str) -> dict[int, float]:
    """Return how long it took to reach every checkpoint.

    Time runs from `Start offline training` and includes saving and the evaluations within the training. A training that
    was continued starts from the checkpoint before the first that it reaches; what it had done beyond that is lost,
    and not counted. (The line of a checkpoint comes before its files: the last one told may never have been saved.)
    """
    minutes: dict[int, float] = {}
    start: datetime | None = None
    before: float | None = None
    for match in _LINE.finditer(text):
        time = datetime.fromisoformat(match["time"])
        if match["start"]:
            start, before = time, None
        elif start is not None:
            step = int(match["step"])
            if before is None:
                before = max((told for earlier, told in minutes.items() if earlier < step), default=0.0)
            minutes[step] = before + (time - start).total_seconds() / 60.0
    return minutes
