"""Avalanches: eight-neighbour Jacobi relaxation of a height field to the repose angle.

Soil runs from a column to each of its eight neighbours that lies lower than the repose slope allows, a fixed
fraction of the excess per sweep. What leaves one column enters another, so the volume is exact. Only columns
marked active are looked at; a column that changes marks itself and its neighbours for the next sweep.

A rigid body over a column gives it a ceiling: soil below the ceiling takes no more than fits under it, and soil
above the ceiling lies in or on that body and takes no part.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.soil.arrays import Array, Flags, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.errors import ExcavError, require

FLOW_FRACTION = 0.1
"""Share of the excess height moved to each neighbour per sweep (tuned). Eight shares stay below 1, so heights
never become negative; below 1/8 no checkerboard can grow."""

REST_TAN = 1e-3
"""Slope excess (tangent) that counts as rest (tuned): 0.04 degrees at 39 degrees."""

_MAX_SWEEPS = 200_000


@kernel
def mark_around(active: Flags, i: int, j: int) -> None:
    """Mark a column and its neighbours active."""
    nx, ny = active.shape
    for a in range(max(0, i - 1), min(nx, i + 2)):
        for b in range(max(0, j - 1), min(ny, j + 2)):
            active[a, b] = 1


@kernel
def _column_outflow(
    heights: Array, delta: Array, ceiling: Array, i: int, j: int, rise: Vector, rest: Vector, border_height: float
) -> float:
    """Book what one column gives to its neighbours; return what runs over the border."""
    nx, ny = heights.shape
    over_border = 0.0
    for a in range(-1, 2):
        for b in range(-1, 2):
            if a == 0 and b == 0:
                continue
            kind = 2 if a != 0 and b != 0 else (0 if a != 0 else 1)
            p, q = i + a, j + b
            outside = p < 0 or q < 0 or p >= nx or q >= ny
            other = border_height if outside else heights[p, q]
            excess = heights[i, j] - other - rise[kind]
            if not outside:
                excess = min(excess, ceiling[p, q] - other)
            if excess > rest[kind]:
                moved = FLOW_FRACTION * excess
                delta[i, j] -= moved
                if outside:
                    over_border += moved
                else:
                    delta[p, q] += moved
    return over_border


@kernel
def sweep(
    heights: Array, delta: Array, active: Flags, ceiling: Array, cell_m: Level, slope_tan: float, border_height: float
) -> tuple[float, int]:
    """Let the active columns flow once; heights [m] change in place, and `active` then marks those for the next sweep.

    Soil above the ceiling [m] neither gives nor takes; it is infinite without a body above. `delta` is a work array of
    zeros, and zero again afterwards. An infinite `border_height` [m] closes the border. All arrays are (nx, ny).
    Returns the height [m] that ran over the border and the number of columns that changed.
    """
    nx, ny = heights.shape
    diagonal = math.sqrt(cell_m[0] ** 2 + cell_m[1] ** 2)
    rise = (slope_tan * cell_m[0], slope_tan * cell_m[1], slope_tan * diagonal)
    rest = (REST_TAN * cell_m[0], REST_TAN * cell_m[1], REST_TAN * diagonal)
    over_border = 0.0
    i_low, i_high, j_low, j_high = nx, -1, ny, -1
    for i in range(nx):
        for j in range(ny):
            if active[i, j]:
                active[i, j] = 0
                if heights[i, j] > ceiling[i, j]:
                    continue
                over_border += _column_outflow(heights, delta, ceiling, i, j, rise, rest, border_height)
                i_low, i_high = min(i_low, i), max(i_high, i)
                j_low, j_high = min(j_low, j), max(j_high, j)
    changed = 0
    for i in range(max(0, i_low - 1), min(nx, i_high + 2)):
        for j in range(max(0, j_low - 1), min(ny, j_high + 2)):
            if delta[i, j] != 0.0:
                heights[i, j] += delta[i, j]
                delta[i, j] = 0.0
                mark_around(active, i, j)
                changed += 1
    return over_border, changed


def relax(heights_m: ArrayLike, cell_size_m: float, slope_tan: float) -> Array:
    """Let a height field (nx, ny) avalanche to full rest inside a closed border.

    Returns new heights [m] with the same volume, no slope steeper than the repose angle by more than `REST_TAN`.

    Raises:
        ConfigurationError: A height is negative or not finite, or a size or slope is not positive.
        ExcavError: No rest within the sweep limit.
    """
    heights = np.array(heights_m, dtype=np.float64)
    require(heights.ndim == 2, f"heights_m has shape {heights.shape}; allowed: (nx, ny).")
    sound = bool(np.isfinite(heights).all() and (heights >= 0).all())
    require(sound, "heights_m has values that are not finite or below 0.")
    require(
        cell_size_m > 0 and slope_tan > 0, f"cell_size_m={cell_size_m!r}, slope_tan={slope_tan!r}; allowed: above 0."
    )
    delta = np.zeros_like(heights)
    active = np.ones(heights.shape, dtype=np.uint8)
    ceiling = np.full(heights.shape, math.inf)
    cell = (float(cell_size_m), float(cell_size_m))
    for _ in range(_MAX_SWEEPS):
        _, changed = sweep(heights, delta, active, ceiling, cell, float(slope_tan), math.inf)
        if changed == 0:
            return heights
    raise ExcavError(f"no rest after {_MAX_SWEEPS} sweeps; use a coarser cell_size_m than {cell_size_m}.")
