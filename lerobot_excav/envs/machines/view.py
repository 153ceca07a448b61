"""What a task needs of pictures for people."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class View(Protocol):
    """Draws a machine and its surroundings for people, as they are when a picture is asked for."""

    def mark(self, commanded: Any, *, shown: Any = None) -> None:
        """Mark what is commanded, and what a policy was shown in its place, from now on; each as the machine knows it.

        Nothing is shown in its place unless the mask is of another target.
        """

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8."""

    def close(self) -> None:
        """Free the graphics context."""
