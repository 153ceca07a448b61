"""Pictures that a policy sees for several frames: a slow camera, or one at which nobody looks in between."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Pixels = Mapping[str, NDArray[np.uint8]]


class HeldPictures:
    """Draws pictures every n-th frame, and holds them until then.

    Frames are counted from the start of the episode, and from the last change of the mask as well: a policy that
    executes n actions of a plan looks at no other pictures, whether it plans again when the mask changes or sees none.

    Args:
        every: n.
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self._changed = 0  # frame of the last change of the mask
        self._mask = b""
        self._held: Pixels | None = None

    def forget(self) -> None:
        """Hold nothing: another episode begins."""
        self._changed, self._mask, self._held = 0, b"", None

    def shown(
        self, frame: int, mask: NDArray[np.bool_] | None, draw: Callable[[], Pixels]
    ) -> dict[str, NDArray[np.uint8]]:
        """Return the pictures by camera after so many actions, under a mask (H, W); they are the caller's own."""
        if self.every == 1:
            return dict(draw())
        key = b"" if mask is None else mask.tobytes()
        if key != self._mask:
            self._mask, self._changed = key, frame
        if self._held is None or frame % self.every == 0 or (frame - self._changed) % self.every == 0:
            self._held = draw()
        return {camera: picture.copy() for camera, picture in self._held.items()}
