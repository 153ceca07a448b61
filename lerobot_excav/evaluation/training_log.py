"""How long a training took, from what `lerobot-train` printed."""

import re
from datetime import datetime
from pathlib import Path

_LINE = re.compile(
    r"INFO (?P<time>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) \S+ "
    r"(?:(?P<start>Start offline training)|Checkpoint policy after step (?P<step>\d+))"
)


def training_minutes(log: Path) -> dict[int, float]:
    """Return how long it took to reach every checkpoint, by its step [min].

    Time runs from `Start offline training` and includes saving and the evaluations within the training. A training that
    was continued goes on from the checkpoint before the first that it reaches; what it had done beyond that is lost,
    and not counted. (The line of a checkpoint comes before its files: the last one told may never have been saved.)

    Args:
        log: What `lerobot-train` printed, of all its runs one after the other; a missing file gives nothing.
    """
    minutes: dict[int, float] = {}
    start: datetime | None = None
    before: float | None = None
    for match in _LINE.finditer(log.read_text(errors="replace") if log.is_file() else ""):
        time = datetime.fromisoformat(match["time"])
        if match["start"]:
            start, before = time, None
        elif start is not None:
            step = int(match["step"])
            if before is None:
                before = max((told for earlier, told in minutes.items() if earlier < step), default=0.0)
            minutes[step] = before + (time - start).total_seconds() / 60.0
    return minutes
