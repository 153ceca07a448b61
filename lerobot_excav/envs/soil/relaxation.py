"""Height fields brought to rest: what scenes start from."""

import math

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.layer import Ground, Layer
from lerobot_excav.errors import ExcavError, require

_TIME_LIMIT_S = 60.0

_EASE_TAN = 2e-3
"""How much flatter (tangent) soil is brought to rest after every later look that still found it moving (tuned): 0.07
degrees at 39 degrees. At the very limit a long slope creeps for half a minute, a hundredth of a millimetre per tick."""

_TICKS_PER_LOOK = 10
_LOOKS_BEFORE = 15  # while an avalanche of some metres runs out, nothing is eased


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
    layer = _standing(heights)
    for look in range(round(_TIME_LIMIT_S / (_TICKS_PER_LOOK * TICK_S))):
        if not flow(_standing(layer.heights), stays, TICK_S)[1]:
            return layer.heights
        eased = stays._replace(slope_tan=max(slope - max(0, look - _LOOKS_BEFORE) * _EASE_TAN, 0.5 * slope))
        for _ in range(_TICKS_PER_LOOK):
            flow(layer, eased, TICK_S)
    raise ExcavError(f"no rest after {_TIME_LIMIT_S} s; use a coarser cell_size_m than {cell_size_m}.")


def _standing(heights_m: Array) -> Layer:
    """Return columns of these heights (nx, ny) [m] without a mobile layer, all of them to be looked at."""
    layer = Layer.empty((heights_m.shape[0], heights_m.shape[1]))
    layer.heights[:] = heights_m
    layer.bed[:] = heights_m
    layer.active[:] = 1
    return layer
