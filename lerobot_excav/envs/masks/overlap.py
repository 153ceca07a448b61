"""How well the masks of an episode fit their targets."""

import numpy as np

from lerobot_excav.envs.masks.source import Pixels


class MaskOverlap:
    """Intersection over union of the mask as shown and the target, as a mean over the frames of an episode.

    The target counts as it was when it was commanded: a block that was lifted away from its mask is not missed by it.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin with no frame: an episode starts."""
        self._target: Pixels | None = None
        self._overlaps: dict[int, float] = {}

    def begin(self, target: Pixels) -> None:
        """Take the pixels of the commanded target, (H, W) bool, for the masks that are added from now on."""
        self._target = target

    def add(self, shown: Pixels, frame: int) -> None:
        """Take the mask of a frame, (H, W) bool; an empty one fits nothing. Of a frame only the last mask counts."""
        if self._target is not None:
            union = np.count_nonzero(shown | self._target)
            self._overlaps[frame] = np.count_nonzero(shown & self._target) / union if union else 0.0

    @property
    def mean(self) -> float | None:
        """Mean over the frames, 0 to 1; None before the first."""
        return sum(self._overlaps.values()) / len(self._overlaps) if self._overlaps else None
