"""Slope of the surface at the faces between columns."""

import math

from lerobot_excav.envs.soil.arrays import Array, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import Ground

_SAME_SIGN = 1e-9
"""Product of two slopes from which on they point the same way; at a closed border one is zero but for rounding."""

_FARTHEST_ASIDE = 4.0
"""Tangent of how far aside of the axis of a face a way down through it can lead (tuned): through a face between level
columns none does."""


@kernel
def _height(heights: Array, i: int, j: int, border_height: float) -> float:
    """Return the height [m] of a column; outside that of the border, or of the nearest column if it is closed."""
    nx, ny = heights.shape
    if 0 <= i < nx and 0 <= j < ny:
        return float(heights[i, j])
    if border_height < math.inf:
        return border_height
    return float(heights[min(max(i, 0), nx - 1), min(max(j, 0), ny - 1)])


@kernel
def surface_slope(heights: Array, ground: Ground, axis: int, i: int, j: int) -> Vector:
    """Return the slope of the surface at a face, along its axis and across it, and the greatest slope down through it.

    Across it is the mean of both sides of the face; on a crest or in a valley, where they differ in sign, the steeper
    one: their mean would hide the slope. The greatest slope is that of the steepest way from the higher of the two
    columns between the lower one and a column beside that, which `bed` looks at, too.
    """
    di, dj, border = 1 - axis, axis, ground.border_height
    step, side = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    before, after = _height(heights, i - di, j - dj, border), _height(heights, i, j, border)
    low_before, low_after = (
        _height(heights, i - di - dj, j - dj - di, border),
        _height(heights, i - dj, j - di, border),
    )
    high_before, high_after = (
        _height(heights, i - di + dj, j - dj + di, border),
        _height(heights, i + dj, j + di, border),
    )
    left = (before + after - (low_before + low_after)) / (2.0 * side)
    right = ((high_before + high_after) - before - after) / (2.0 * side)
    aside = left if abs(left) > abs(right) else right
    if left * right > _SAME_SIGN:
        aside = 0.5 * (left + right)
    down = (after - before) / step
    drop = before - min(low_before, high_before) if before < after else after - min(low_after, high_after)
    turned = min(max(drop, 0.0) / side, _FARTHEST_ASIDE * abs(down))
    return down, aside, math.sqrt(down * down + turned * turned)
