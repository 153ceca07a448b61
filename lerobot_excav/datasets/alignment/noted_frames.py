"""What the alignment log of a recording says of its frames."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from lerobot_excav.errors import DatasetError
from lerobot_excav.robots.excavator_testbed.alignment import IMAGE_LIMIT_MS, STATE_LIMIT_MS

UNKNOWN_AGE_MS = -1.0
"""Age of pictures whose cameras tell none."""


class NotedFrame(NamedTuple):
    """What was noted of a frame; see `AlignmentLog`."""

    image_age_ms: float  # of the oldest picture, or `UNKNOWN_AGE_MS`
    state_age_ms: float
    is_causal: bool  # whether both are within their limits
    is_as_told: bool  # whether the machine did what the action says


NotedFrames = Mapping[int, Sequence[NotedFrame]]
"""The frames of every episode, in their order."""


def read_noted_frames(path: Path) -> NotedFrames:
    """Read an alignment log; of an episode that was recorded again the last time counts.

    Raises:
        DatasetError: It is no such log, has other limits, or a line of it cannot be read.
        OSError: It cannot be opened.
    """
    noted: dict[int, list[NotedFrame]] = {}
    for number, record in _records(path):
        if record.get("excavator_testbed") == "alignment":
            _require_limits(path, number, record)
            continue
        try:
            frames = noted.setdefault(int(record["episode_index"]), [])
            if int(record["frame_index"]) == 0:
                frames.clear()
            if int(record["frame_index"]) != len(frames):
                raise ValueError(f"frame {record['frame_index']} follows {len(frames)} frames")
            frames.append(_frame(record))
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise DatasetError(f"{path}, line {number}: is not a frame of an alignment log ({error!r})") from error
    return noted


def _frame(record: dict[str, Any]) -> NotedFrame:
    image_ms = record["image_age_ms"]
    return NotedFrame(
        UNKNOWN_AGE_MS if image_ms is None else float(image_ms),
        float(record["state_age_ms"]),
        bool(record["is_causal"]),
        bool(record["is_as_told"]),
    )


def _records(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the lines with their numbers; one that a crash cut off is passed over."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    if not lines or '"excavator_testbed": "alignment"' not in lines[0]:
        raise DatasetError(
            f"{path} is not an alignment log of --robot.type=excavator_testbed; give its robot.alignment_log"
        )
    for number, line in enumerate(lines, start=1):
        try:
            record = json.loads(line)
        except json.JSONDecodeError as error:
            if line.rstrip().endswith("}"):
                raise DatasetError(f"{path}, line {number}: {error}; the file is damaged") from error
            continue
        if not isinstance(record, dict):
            raise DatasetError(f"{path}, line {number}: is not a frame of an alignment log ({line[:40]})")
        yield number, record


def _require_limits(path: Path, number: int, record: dict[str, Any]) -> None:
    limits = record.get("image_limit_ms"), record.get("state_limit_ms")
    if limits != (IMAGE_LIMIT_MS, STATE_LIMIT_MS):
        raise DatasetError(
            f"{path}, line {number}: its limits are {limits[0]} and {limits[1]} ms; those of this version are "
            f"{IMAGE_LIMIT_MS:g} and {STATE_LIMIT_MS:g} ms, so its marks mean something else"
        )
