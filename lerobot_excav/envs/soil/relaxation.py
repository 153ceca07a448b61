"""Height fields brought to rest: what scenes start from."""

import math

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.layer import Ground, Layer
from lerobot_excav.errors import ExcavError, require

_TIME_LIMIT_S = 200.0


def relax(heights_m: ArrayLike, cell_size_m: float, slope_tan: float) -> Array:
    """Let a height field (nx, ny) avalanche to full rest inside a closed border.

    Returns new heights [m] with the same volume, which rest at the repose angle as soil in a `Soil` does.

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
    nx, ny = heights.shape
    layer = Layer.empty((nx, ny))
    layer.heights[:] = heights
    layer.bed[:] = heights
    layer.active[:] = 1
    ground = Ground(float(slope_tan), 0.0, 1.0, float(cell_size_m), float(cell_size_m), math.inf)
    for _ in range(round(_TIME_LIMIT_S / TICK_S)):
        _, moves = flow(layer, ground, TICK_S)
        if not moves:
            return layer.heights
    raise ExcavError(f"no rest after {_TIME_LIMIT_S} s; use a coarser cell_size_m than {cell_size_m}.")
