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
    was continued goes on from its last checkpoint; what it had done beyond that is lost, and not counted.

    Args:
        log: What `lerobot-train` printed, of all its runs one after the other; a missing file gives nothing.
    """
    minutes: dict[int, float] = {}
    before, start = 0.0, None
    for match in _LINE.finditer(log.read_text(errors="replace") if log.is_file() else ""):
        time = datetime.fromisoformat(match["time"])
        if match["start"]:
            before, start = max(minutes.values(), default=0.0), time
        elif start is not None:
            minutes[int(match["step"])] = before + (time - start).total_seconds() / 60.0
    return minutes
