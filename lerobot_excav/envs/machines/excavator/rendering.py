"""Camera pictures of the worksite: colour, depth and the terrain point behind every pixel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.envs.machines.excavator.bodywork import LOOSE_SOIL_GROUP, MACHINE_GROUP, SURROUNDINGS_GROUP
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.soil import Soil

CAMERAS = ("main", "cab", "overview", "side")
_MAX_GEOMS = 300


class WorksiteRenderer:
    """Draws a machine and its soil into images.

    The graphics context is made with the first picture, in the process that asks for it.

    Args:
        machine: The machine; its current state is drawn.
        height: Image height H [px].
        width: Image width W [px].
    """

    def __init__(self, machine: ExcavatorMachine, *, height: int, width: int) -> None:
        self._machine = machine
        self._soil_picture = SoilPicture(machine)
        self._pictures = CameraPictures(
            machine.model, machine.data, cameras=CAMERAS, height=height, width=width, max_geoms=_MAX_GEOMS
        )
        self._all: Any = visible_groups(SURROUNDINGS_GROUP, MACHINE_GROUP, LOOSE_SOIL_GROUP)
        self._without_machine: Any = visible_groups(SURROUNDINGS_GROUP)

    def render(self, camera: str, soil: Soil) -> NDArray[np.uint8]:
        """Return a colour picture (H, W, 3), uint8.

        Args:
            camera: `main`, `cab`, `overview` or `side`.
            soil: The soil to draw.

        Raises:
            ConfigurationError: There is no such camera.
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        self._soil_picture.update(soil)
        return self._pictures.colour(camera, self._all)

    def depth(self, camera: str, soil: Soil) -> NDArray[np.float32]:
        """Return the distance along the optical axis (H, W) [m], float32; the far plane where nothing is.

        Arguments and errors are those of `render`.
        """
        self._soil_picture.update(soil)
        return self._pictures.distance_m(camera, self._all).astype(np.float32)

    def terrain_points_w(self, soil: Soil) -> NDArray[np.float64]:
        """Return the point of the soil surface that every pixel of `main` sees once the machine is gone.

        Args:
            soil: The soil to look at.

        Returns:
            World points (H, W, 3) [m]; NaN where the pixel shows no soil of the dig area.

        Raises:
            RenderingError: No graphics context can be made, or the renderer was closed.
        """
        self._soil_picture.update(soil)
        points_w = self._pictures.points_w("main", self._without_machine)
        half_x, half_y = 0.5 * np.asarray(self._machine.terrain_shape_m)
        inside = (np.abs(points_w[..., 0]) <= half_x) & (np.abs(points_w[..., 1]) <= half_y)
        points_w[~inside] = np.nan
        return points_w

    def close(self) -> None:
        """Free the graphics context; the renderer cannot be used afterwards."""
        self._pictures.close()
