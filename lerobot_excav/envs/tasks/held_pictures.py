"""Pictures that a policy sees for several frames: a slow camera, or one at which nobody looks in between."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Pixels = Mapping[str, NDArray[np.uint8]]


class HeldPictures:
    """Draws pictures every n-th frame, and when the mask shows something else, and holds them until then.

    A policy that executes n actions of a plan and plans again when the mask changes looks at no other pictures.

    Args:
        every: n.
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self._held: tuple[int, bytes, Pixels] | None = None  # since which frame, under which mask, what

    def forget(self) -> None:
        """Hold nothing: another episode begins."""
        self._held = None

    def shown(
        self, frame: int, mask: NDArray[np.bool_] | None, draw: Callable[[], Pixels]
    ) -> dict[str, NDArray[np.uint8]]:
        """Return the pictures by camera at a frame, under a mask (H, W); they are the caller's own."""
        if self.every == 1:
            return dict(draw())
        key = b"" if mask is None else mask.tobytes()
        if self._held is None or self._held[1] != key or frame - self._held[0] >= self.every:
            self._held = frame, key, draw()
        return {camera: picture.copy() for camera, picture in self._held[2].items()}
