"""How old what was seen was when an action was chosen, frame by frame.

A policy learns to answer what it sees. If what is stored as seen was older than what was done about it, it learns to
answer late. So every frame is measured, and those that break a limit are marked:

    {"excavator_testbed": "alignment", "image_limit_ms": 120, "state_limit_ms": 100}
    {"episode_index": 0, "frame_index": 12, "image_age_ms": 84.1, "state_age_ms": 9.8, "refusal": "NONE",
     "is_causal": true, "is_as_told": true}

LeRobot records the action as it came. `is_as_told` is false where the machine did something else: it stood still for a
reason of its own, or the action was faster than allowed. Do not train on such frames.
"""

from dataclasses import dataclass
from pathlib import Path

from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.journal import ForeignFileError, Journal

IMAGE_LIMIT_MS = 120.0
STATE_LIMIT_MS = 100.0
"""Greatest ages of pictures and state beside an action [ms] (kind: those of the rigs this follows)."""


@dataclass(frozen=True, kw_only=True)
class Ages:
    """How old the oldest picture and the state were when the action was sent [ms]; pictures may be of unknown age."""

    image_ms: float | None
    state_ms: float

    @property
    def is_causal(self) -> bool:
        """Whether both are within their limits."""
        return self.state_ms <= STATE_LIMIT_MS and (self.image_ms is None or self.image_ms <= IMAGE_LIMIT_MS)


class AlignmentLog:
    """Writes the ages of every frame down; between episodes nothing is noted.

    Attributes:
        frames: Frames that were written since the log was started.
        late_frames: How many of them broke a limit.
        other_frames: In how many of them the machine did not do what the action says.

    Raises:
        DeviceError: From every method: the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.frames, self.late_frames, self.other_frames = path, 0, 0, 0
        self._journal = Journal(path, mark='"excavator_testbed": "alignment"')
        self._episode: int | None = None
        self._frame = 0

    def start(self) -> None:
        """Open the file."""
        self.frames = self.late_frames = self.other_frames = 0
        try:
            self._journal.start()
            limits = {"image_limit_ms": IMAGE_LIMIT_MS, "state_limit_ms": STATE_LIMIT_MS}
            self._journal.write({"excavator_testbed": "alignment", **limits})
        except (ForeignFileError, OSError) as error:
            raise DeviceError(f"robot.alignment_log={self.path} cannot be written: {error}; give another") from error

    def begin(self, episode_index: int) -> None:
        """Begin an episode of the dataset; if there was one of this number, it is recorded again."""
        self._episode, self._frame = episode_index, 0

    def end(self) -> None:
        """End it."""
        self._episode = None

    def note(self, ages: Ages, refusal: str, *, is_as_told: bool) -> None:
        """Note a frame."""
        if self._episode is None:
            return
        self.frames += 1
        self.late_frames += not ages.is_causal
        self.other_frames += not is_as_told
        image_ms = None if ages.image_ms is None else round(ages.image_ms, 2)
        record = {
            "episode_index": self._episode,
            "frame_index": self._frame,
            "image_age_ms": image_ms,
            "state_age_ms": round(ages.state_ms, 2),
            "refusal": refusal,
            "is_causal": ages.is_causal,
            "is_as_told": is_as_told,
        }
        self._frame += 1
        try:
            self._journal.write(record)
        except OSError as error:
            raise DeviceError(f"robot.alignment_log={self.path} cannot be written: {error}") from error

    def close(self) -> None:
        """Close the file."""
        self._journal.close()
