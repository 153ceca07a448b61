"""Camera pictures of the work cell, and the pixels that each block covers."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.geoms import ARM, BLOCK, CELL
from lerobot_excav.envs.machines.fr5.workcell import Workcell
from lerobot_excav.envs.machines.pinhole import PinholeCamera

_MAX_GEOMS = 100


class WorkcellRenderer:
    """Draws a work cell into images; the graphics context is made with the first picture.

    Every method that draws raises `ConfigurationError` if there is no such camera, and `RenderingError` if no graphics
    context can be made or the renderer was closed.

    Args:
        workcell: The cell; its current state is drawn.
        height: Image height H [px].
        width: Image width W [px].
    """

    def __init__(self, workcell: Workcell, *, height: int, width: int) -> None:
        model = workcell.model
        self._pictures = CameraPictures(
            model, workcell.data, cameras=tuple(layout.CAMERAS), height=height, width=width, max_geoms=_MAX_GEOMS
        )
        self._all = visible_groups(CELL.group, ARM.group, BLOCK.group)
        self._without_arm = visible_groups(CELL.group, BLOCK.group)
        self._block_geoms = np.array([model.geom(f"block{i}").id for i in range(layout.BLOCK_COUNT)])

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return the colour picture (H, W, 3), uint8, of one of `layout.CAMERAS`."""
        return self._pictures.colour(camera, self._all)

    def depth_m(self, camera: str) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m], float32; the far plane where nothing is."""
        return self._pictures.distance_m(camera, self._all).astype(np.float32)

    def camera(self, camera: str) -> PinholeCamera:
        """Return where a camera stands, and how it projects."""
        return self._pictures.pinhole(camera)

    def block_pixels(self) -> NDArray[np.bool_]:
        """Return the pixels of `main` that show each block once the arm is gone, (4, H, W) bool."""
        shown = self._pictures.geoms("main", self._without_arm)
        return np.asarray(shown == self._block_geoms[:, None, None])

    def close(self) -> None:
        """Free the graphics context; the renderer cannot be used afterwards."""
        self._pictures.close()
