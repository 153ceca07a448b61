"""Which pixels of a picture with depth show a dig region."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.envs.tasks.planner.surface import see_surface
from lerobot_excav.envs.tasks.scoop.targets import Target


def region_pixels(place_w: NDArray[np.float64], shot: Shot) -> Pixels:
    """Return the pixels (H, W) of a shot that show the soil of the region around a place (3,) [m].

    The machine is no soil. It follows from depth alone, in a simulator as on a real machine.

    Raises:
        ConfigurationError: The shot has no depth, or its camera is not calibrated.
    """
    region = Target(center_w=place_w, yaw_rad=cylinder_from_world(place_w)[1])
    points_w = shot.points_w()
    assert shot.depth_m is not None  # or there were no points
    assert shot.camera is not None
    return region.contains(points_w) & see_surface(shot.depth_m, shot.camera).shows(points_w)
