"""Height fields brought to rest: what scenes start from."""

import math

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.layer import Ground, Layer
from lerobot_excav.errors import ExcavError, require

_TIME_LIMIT_S = 600.0
"""Simulated time within which a pile must rest [s] (tuned): in two of 300 drawn scenes it takes 78 and 80 s."""

_FLATTER_TAN = 1e-2
"""How much flatter (tangent) than repose soil is brought to rest (tuned): 0.35 degrees at 39 degrees. What has only
just stopped at the very limit would start again at a touch."""

_STEP_S = 0.1


def relax(heights_m: ArrayLike, cell_size_m: float, slope_tan: float) -> Array:
    """Let a height field (nx, ny) avalanche to full rest inside a closed border.

    Returns new heights [m] with the same volume, at which soil in a `Soil` stays as it is.

    Raises:
        ConfigurationError: A height is negative or not finite, or a size or slope is not positive.
        ExcavError: No rest within the time limit.
    """
    heights = np.array(heights_m, dtype=np.float64)
    require(heights.ndim == 2, f"heights_m has shape {heights.shape}; allowed: (nx, ny).")
    sound = bool(np.isfinite(heights).all() and (heights >= 0).all())
    require(sound, "heights_m has values that are not finite or below 0.")
    require(
        cell_size_m > 0 and slope_tan > 0, f"cell_size_m={cell_size_m!r}, slope_tan={slope_tan!r}; allowed: above 0."
    )
    cell, slope = float(cell_size_m), float(slope_tan)
    stays = Ground(slope, 0.0, 1.0, cell, cell, math.inf)
    layer, left_s = _standing(heights), _TIME_LIMIT_S
    while left_s > 0.0:
        if not flow(_standing(layer.heights), stays, TICK_S)[1]:
            return layer.heights
        layer, moves = _standing(layer.heights), True
        while moves and left_s > 0.0:
            _, moves = flow(layer, stays._replace(slope_tan=max(slope - _FLATTER_TAN, 0.5 * slope)), _STEP_S)
            left_s -= _STEP_S
    raise ExcavError(f"no rest after {_TIME_LIMIT_S} s; use a coarser cell_size_m than {cell_size_m}.")


def _standing(heights_m: Array) -> Layer:
    """Return columns of these heights (nx, ny) [m] without a mobile layer, all of them to be looked at."""
    layer = Layer.empty((heights_m.shape[0], heights_m.shape[1]))
    layer.heights[:] = heights_m
    layer.bed[:] = heights_m
    layer.active[:] = 1
    return layer
