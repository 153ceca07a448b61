"""Camera pictures of the worksite: colour, depth and the terrain point behind every pixel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.envs.machines.excavator.bodywork import LOOSE_SOIL_GROUP, MACHINE_GROUP, SURROUNDINGS_GROUP
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.machines.pinhole import PinholeCamera

CAMERAS = ("main", "cab", "overview", "side")
_MAX_GEOMS = 300


class WorksiteRenderer:
    """Draws a worksite as it is when a picture is asked for.

    The graphics context is made with the first picture, in the process that asks for it. Every method that draws raises
    `ConfigurationError` if there is no such camera, and `RenderingError` if no graphics context can be made or the
    renderer was closed.

    Args:
        worksite: Machine, soil and target box.
        height: Image height H [px].
        width: Image width W [px].
    """

    def __init__(self, worksite: Worksite, *, height: int, width: int) -> None:
        self._worksite = worksite
        machine = worksite.machine
        self._soil_picture = SoilPicture(machine.model, machine)
        self._pictures = CameraPictures(
            machine.model, machine.data, cameras=CAMERAS, height=height, width=width, max_geoms=_MAX_GEOMS
        )
        self._all: Any = visible_groups(SURROUNDINGS_GROUP, MACHINE_GROUP, LOOSE_SOIL_GROUP)
        self._without_machine: Any = visible_groups(SURROUNDINGS_GROUP)

    def render(self, camera: str) -> NDArray[np.uint8]:
        """Return the colour picture (H, W, 3), uint8, of one of `CAMERAS`."""
        self._soil_picture.update(self._worksite.soil, self._worksite.start_heights_m)
        return self._pictures.colour(camera, self._all)

    def depth_m(self, camera: str) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m], float32; the far plane where nothing is."""
        self._soil_picture.update(self._worksite.soil, self._worksite.start_heights_m)
        return self._pictures.distance_m(camera, self._all).astype(np.float32)

    def camera(self, camera: str) -> PinholeCamera:
        """Return where a camera stands now, and how it projects."""
        return self._pictures.pinhole(camera)

    def terrain_points_w(self) -> NDArray[np.float64]:
        """Return the point of the soil surface (H, W, 3) [m] that every pixel of `main` sees once the machine is gone.

        It is NaN where the pixel shows no soil of the dig area.
        """
        self._soil_picture.update(self._worksite.soil, self._worksite.start_heights_m)
        points_w = self._pictures.points_w("main", self._without_machine)
        half_x, half_y = 0.5 * np.asarray(DIG_AREA_EXTENT_M)
        inside = (np.abs(points_w[..., 0]) <= half_x) & (np.abs(points_w[..., 1]) <= half_y)
        points_w[~inside] = np.nan
        return points_w

    def close(self) -> None:
        """Free the graphics context; the renderer cannot be used afterwards."""
        self._pictures.close()
