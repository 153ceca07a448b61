"""Soil before the side plates of a bucket that moves sideways."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Vector
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
    n = (normal[0], normal[1], normal[2])
    low, top, surface = math.inf, -math.inf, -math.inf
    for k in range(len(corners)):
        low, top = min(low, corners[k, 2]), max(top, corners[k, 2])
        surface = max(surface, corners[k, 2] + overlap(heights, grid, corners[k, 0], corners[k, 1], corners[k, 2], n))
    level = math.sqrt(n[0] ** 2 + n[1] ** 2)
    step = (min(top, surface) - low) / _SIDE_ROWS
    if step <= 0.0 or level < 0.5:  # a bucket that lies on its side is left out
        return points, limits
    for row in range(_SIDE_ROWS):
        one, other = chord(corners, low + (row + 0.5) * step)
        length = math.sqrt((other[0] - one[0]) ** 2 + (other[1] - one[1]) ** 2 + (other[2] - one[2]) ** 2)
        for column in range(_SIDE_COLUMNS):
            k = row * _SIDE_COLUMNS + column
            share = (column + 0.5) / _SIDE_COLUMNS
            x = one[0] + share * (other[0] - one[0])
            y = one[1] + share * (other[1] - one[1])
            z = one[2] + share * (other[2] - one[2])
            points[k, 0], points[k, 1], points[k, 2] = x, y, z
            depth = overlap(heights, grid, x, y, z - 0.5 * step, n)
            if depth > 0.0:
                area, foot = length / _SIDE_COLUMNS * step / level, (x, y, z - 0.5 * step)
                limits[k] = area * wedge_pressure(weighed, grid, foot, z + 0.5 * step, n, depth, soil)
    return points, limits


@kernel
def chord(corners: Array, z: float) -> tuple[Vector, Vector]:
    """Return the two points where a level line at a height crosses a convex outline of (n, 3) corners."""
    one, other, found = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0
    for k in range(len(corners)):
        m = (k + 1) % len(corners)
        x, y, start, end = corners[k, 0], corners[k, 1], corners[k, 2], corners[m, 2]
        if (start - z) * (end - z) < 0.0 or start == z:
            other = one if found else other
            share = 0.0 if start == z else (z - start) / (end - start)
            one = (x + share * (corners[m, 0] - x), y + share * (corners[m, 1] - y), start + share * (end - start))
            found += 1
    return one, other
