"""Soil before the side plates of a bucket that moves sideways."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.bearing import overlap, wedge_pressure
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid
from lerobot_excav.envs.soil.wedge import SoilStrength

_SIDE_ROWS, _SIDE_COLUMNS = 3, 2
"""Patches over the buried height and the length of a side plate."""


@kernel
def side_limits(
    heights: Array, weighed: Array, grid: Grid, corners: Array, normal: Array, soil: SoilStrength
) -> tuple[Array, Array]:
    """Return points (k, 3) and greatest pushes (k,) [N] of the soil on one side plate, by rows over its buried height.

    The corners (n, 3) are those of its outline, in the world with z above the rigid floor.
    """
    points, limits = np.zeros((_SIDE_ROWS * _SIDE_COLUMNS, 3)), np.zeros(_SIDE_ROWS * _SIDE_COLUMNS)
    low, top, surface = math.inf, -math.inf, -math.inf
    for k in range(len(corners)):
        low, top = min(low, corners[k, 2]), max(top, corners[k, 2])
        surface = max(
            surface, corners[k, 2] + overlap(heights, grid, corners[k, 0], corners[k, 1], corners[k, 2], normal)
        )
    level = math.sqrt(normal[0] ** 2 + normal[1] ** 2)
    step = (min(top, surface) - low) / _SIDE_ROWS
    if step <= 0.0 or level < 0.5:  # a bucket that lies on its side is left out
        return points, limits
    for row in range(_SIDE_ROWS):
        one, other = chord(corners, low + (row + 0.5) * step)
        length = math.sqrt(np.sum((other - one) ** 2))
        for column in range(_SIDE_COLUMNS):
            k = row * _SIDE_COLUMNS + column
            points[k] = one + (column + 0.5) / _SIDE_COLUMNS * (other - one)
            x, y, z = points[k]
            depth = overlap(heights, grid, x, y, z - 0.5 * step, normal)
            if depth > 0.0:
                area, foot = length / _SIDE_COLUMNS * step / level, (x, y, z - 0.5 * step)
                limits[k] = area * wedge_pressure(weighed, grid, foot, z + 0.5 * step, normal, depth, soil)
    return points, limits


@kernel
def chord(corners: Array, z: float) -> tuple[Array, Array]:
    """Return the two points where a level line at a height crosses a convex outline of (n, 3) corners."""
    one, other, found = np.zeros(3), np.zeros(3), 0
    for k in range(len(corners)):
        a, b = corners[k], corners[(k + 1) % len(corners)]
        if (a[2] - z) * (b[2] - z) < 0.0 or a[2] == z:
            other = one.copy() if found else other
            one = a if a[2] == z else a + (z - a[2]) / (b[2] - a[2]) * (b - a)
            found += 1
    return one, other
