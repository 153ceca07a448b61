"""What a task needs of the renderer of a machine."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera


class Renderer(Protocol):
    """Draws a machine and its surroundings as they are when a picture is asked for."""

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8."""

    def depth_m(self, camera: str) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m], float32."""

    def camera(self, camera: str) -> PinholeCamera:
        """Return where a camera stands now, and how it projects."""

    def close(self) -> None:
        """Free the graphics context."""
