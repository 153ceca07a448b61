"""Takes the running episode down while a recording is on, and asks whether to keep it."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.console.recording import Recording
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.episode import Episode, EpisodeTape
from lerobot_excav.errors import ConfigurationError, require


class Recorder:
    """The episode in hand.

    Args:
        recording: Where episodes go; None if the console was started without `--out`.

    Attributes:
        pair: Start and target of the episode that is recorded; None while nothing is.
        episode: The finished episode that waits for a verdict.
    """

    def __init__(self, recording: Recording | None) -> None:
        self.recording = recording
        self.pair: Pair | None = None
        self.episode: Episode | None = None
        self._tape, self._by_policy = EpisodeTape(), list[bool]()

    @property
    def is_waiting_for_a_verdict(self) -> bool:
        """Whether an episode is finished, and neither kept nor thrown away."""
        return self.episode is not None

    @property
    def is_running(self) -> bool:
        """Whether an episode is taken down."""
        return self.pair is not None and self.episode is None

    @property
    def has_frames(self) -> bool:
        """Whether an episode is in hand, running or finished, that would be lost."""
        return self.pair is not None and self._tape.length > 0

    @property
    def length(self) -> int:
        """Frames of the running episode."""
        return self._tape.length if self.is_running else 0

    def require_recording(self) -> Recording:
        """Return where episodes go.

        Raises:
            ConfigurationError: The console was started without it, or the dataset is written already.
        """
        if self.recording is None:
            raise ConfigurationError("nothing is recorded; start the console with --out=FOLDER, the dataset to be")
        require(
            not self.recording.is_complete, f"{self.recording.out} is written; start the console with another --out"
        )
        return self.recording

    def begin(self, pair: Pair) -> None:
        """Begin to take an episode down; the environment was just reset to its start."""
        self.pair, self.episode = pair, None
        self._tape, self._by_policy = EpisodeTape(), list[bool]()

    def add(self, observation: dict[str, Any], info: dict[str, Any], action: NDArray[Any], *, by_policy: bool) -> None:
        """Take a frame down, before it passes, and whether a policy acts in it."""
        if self.is_running:
            self._tape.add(observation, info, np.asarray(action, np.float32))
            self._by_policy.append(by_policy)

    def note(self, info: dict[str, Any]) -> None:
        """Take down what the frame led to."""
        if self.is_running:
            self._tape.note(info)

    def finish(self, task: str, *, success: bool) -> None:
        """End the episode with its outcome; it then waits for a verdict. One without frames is forgotten."""
        if not self.is_running or self.pair is None:
            return
        if self._tape.length == 0:
            self.forget()
            return
        episode = self._tape.episode(self.pair, task, operator="person")
        if any(self._by_policy):  # then all that a person did is marked, before it and after it
            by_person = ~np.array(self._by_policy)
            episode = replace(episode, operator="policy", intervention=by_person)
        self.episode = replace(episode, success=success)

    def keep(self) -> None:
        """Put the finished episode on the disk.

        Raises:
            ConfigurationError: None is finished.
            DatasetError: It cannot be kept.
        """
        if self.episode is None:
            raise ConfigurationError("no episode is finished; record one first")
        self.require_recording().keep(self.episode)
        self.forget()

    def forget(self) -> None:
        """Throw the episode in hand away."""
        self.pair = self.episode = None

    def state(self) -> dict[str, Any] | None:
        """Return what the page shows of it; None if nothing can be recorded."""
        if self.recording is None:
            return None
        left = [] if self.recording.is_complete else self.recording.left
        episode = self.episode
        return {
            "out": str(self.recording.out),
            "count": self.recording.count,
            "left": len(left),
            "kept": self.recording.kept,
            "next": None if not left else left[0]._asdict(),
            "running": self.is_running,
            "frames": self.length,
            "verdict": None if episode is None else {"success": episode.success, "frames": episode.length},
            "complete": self.recording.is_complete,
        }

    def close(self) -> None:
        """Let go of the recording's folder."""
        if self.recording is not None and not self.recording.is_complete:
            self.recording.close()
