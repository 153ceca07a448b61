"""How well the masks of an episode fit their targets."""

import numpy as np

from lerobot_excav.envs.masks.source import Pixels


class MaskOverlap:
    """Intersection over union of the mask as shown and the target as it is, as a mean over the frames of an episode."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin with no frame: an episode starts."""
        self._target: Pixels | None = None
        self._sum, self._count = 0.0, 0

    def begin(self, target: Pixels) -> None:
        """Take the pixels of the commanded target, (H, W) bool, for the frames from now on."""
        self._target = target

    def add(self, shown: Pixels) -> None:
        """Take a frame with the mask that it shows, (H, W) bool; an empty mask fits nothing."""
        if self._target is not None:
            union = np.count_nonzero(shown | self._target)
            self._sum += np.count_nonzero(shown & self._target) / union if union else 0.0
            self._count += 1

    @property
    def mean(self) -> float | None:
        """Mean over the frames, 0 to 1; None before the first."""
        return self._sum / self._count if self._count else None
