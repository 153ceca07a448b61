"""Where things stand on the worksite: machine, dig area and target box (world frame, see docs/conventions.md)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator.constants import DIG_AREA_EXTENT_M as DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.soil import Container

SOIL_CELL_SIZE_M = 0.05
"""Edge of a column of the soil grid [m] (kind: tuned; coarser columns make the cut jump)."""

# 80 degrees to the left at the radius of the pile: a swing of usual length for loading a truck (kind: design).
TARGET_BOX = Container(
    center_w=np.array([-3.75, 4.75, 0.0]), half_extent_m=np.array([1.1, 1.1]), wall_height_m=1.0, yaw_rad=0.0
)
"""The box that receives the soil."""


def distance_to_box_footprint_m(points_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return distances on the ground plane from points (..., 2) or (..., 3) to the target box [m]; zero above it."""
    local = TARGET_BOX.to_local(np.asarray(points_w)[..., :2])
    outside = np.maximum(np.abs(local) - TARGET_BOX.half_extent_m, 0.0)
    return np.asarray(np.hypot(outside[..., 0], outside[..., 1]))


def cylinder_from_world(point_w: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return a world point's radius from the swing axis [m], swing angle towards it [rad] and height [m]."""
    dx, dy = point_w[0] - MACHINE_POS_W[0], point_w[1] - MACHINE_POS_W[1]
    return float(np.hypot(dx, dy)), float(np.arctan2(dy, dx)), float(point_w[2])


def world_from_cylinder(radius_m: ArrayLike, swing_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the ground-plane points (..., 2) [m] at given radii and swing angles of the machine."""
    radius, swing = np.broadcast_arrays(radius_m, swing_rad)
    offset = np.stack([radius * np.cos(swing), radius * np.sin(swing)], axis=-1)
    return np.asarray(offset + np.asarray(MACHINE_POS_W[:2]))
