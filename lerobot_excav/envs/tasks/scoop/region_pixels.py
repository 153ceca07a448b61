"""Dig regions that somebody points at: whether the bucket reaches them, and which pixels of a picture show them."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.envs.tasks.planner.surface import see_surface
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.errors import require

POINTABLE_RADIUS_M = (2.6, 6.4)
"""Distance from the swing axis at which a person may command a region [m]: the planner's, and 0.2 to 0.3 m more (kind:
guess)."""


def require_pointable(place_w: NDArray[np.float64]) -> None:
    """Check that the bucket digs at a place (3,) [m].

    Raises:
        ConfigurationError: It does not, or nobody knows where the place is.
    """
    require(bool(np.isfinite(place_w).all()), "nothing was measured at this place; command another one")
    radius_m, (low_m, high_m) = float(np.hypot(*(place_w[:2] - MACHINE_POS_W[:2]))), POINTABLE_RADIUS_M
    require(
        low_m <= radius_m <= high_m,
        f"this place is {radius_m:.1f} m from the swing axis; the bucket digs from {low_m} to {high_m} m",
    )


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
