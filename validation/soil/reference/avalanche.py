"""Twin of `relaxation`: one avalanche sweep of all columns."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.relaxation import FLOW_FRACTION, REST_TAN


def steepest(heights: Array, cell_m: float) -> float:
    """Return the tangent of the steepest slope between a column and any of its eight neighbours."""
    straight = max(float(np.abs(np.diff(heights, axis=axis)).max()) for axis in (0, 1))
    one, other = heights[1:, 1:] - heights[:-1, :-1], heights[1:, :-1] - heights[:-1, 1:]
    return max(straight, float(np.abs([one, other]).max()) / math.sqrt(2.0)) / cell_m


def sweep(
    heights: Array, ceiling: Array, cell_m: tuple[float, float], slope_tan: float, border_height: float
) -> tuple[Array, float]:
    """Return the heights after one avalanche sweep of all columns, and the height that ran over the border."""
    nx, ny = heights.shape
    result, over_border = heights.copy(), 0.0
    padded = np.pad(heights, 1, constant_values=border_height)
    limit = np.pad(ceiling, 1, constant_values=math.inf)
    for a, b in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]:
        distance = math.hypot(a * cell_m[0], b * cell_m[1])
        other = padded[1 + a : 1 + a + nx, 1 + b : 1 + b + ny]
        with np.errstate(invalid="ignore"):  # a closed border is as high as its ceiling: infinite
            room = limit[1 + a : 1 + a + nx, 1 + b : 1 + b + ny] - other
        excess = np.minimum(heights - other - slope_tan * distance, room)
        flows = (excess > REST_TAN * distance) & (heights <= ceiling)
        moved = np.where(flows, FLOW_FRACTION * excess, 0.0)
        result -= moved
        arrived = np.zeros((nx + 2, ny + 2))
        arrived[1 + a : 1 + a + nx, 1 + b : 1 + b + ny] = moved
        result += arrived[1:-1, 1:-1]
        over_border += float(arrived.sum() - arrived[1:-1, 1:-1].sum())
    return result, over_border
