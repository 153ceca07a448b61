"""Soil that stands in a height field between high walls, and what becomes of it."""

import math
from collections.abc import Iterator

import numpy as np

from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import Strength
from validation import Array


def across_m(cells: tuple[int, int], cell_m: float, azimuth_deg: float) -> Array:
    """Return the way (nx, ny) of columns from the middle of a field in the direction of an azimuth [m]."""
    x, y = ((np.arange(n) - 0.5 * (n - 1)) * cell_m for n in cells)
    azimuth = math.radians(azimuth_deg)
    return np.asarray(np.add.outer(x * math.cos(azimuth), y * math.sin(azimuth)))


def flowing(
    heights_m: Array, cell_m: float, strength: Strength, step_s: float, limit_s: float
) -> Iterator[HeightField]:
    """Let a field flow until it rests or a time has passed; yield it after every step."""
    nx, ny = heights_m.shape
    field = HeightField((nx, ny), (cell_m, cell_m), math.inf)
    field.reset(heights_m)
    for _ in range(round(limit_s / step_s)):
        before = field.heights.tobytes()
        field.flow(step_s, strength)
        yield field
        if field.heights.tobytes() == before:
            return


def flank_deg(field: HeightField, azimuth_deg: float, ways_m: Array, offset_m: float = 0.0) -> float:
    """Return the slope [deg] of a straight line through heights along an azimuth, `offset_m` [m] beside the middle."""
    azimuth = math.radians(azimuth_deg)
    along, aside = np.array([math.cos(azimuth), math.sin(azimuth)]), np.array([-math.sin(azimuth), math.cos(azimuth)])
    return -math.degrees(math.atan(np.polyfit(ways_m, field.sample(np.outer(ways_m, along) + offset_m * aside), 1)[0]))
