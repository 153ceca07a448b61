"""Twin of `wedge`: the soil above a failure plane."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array


def wedge_area(depths: Array, spacing_m: float, failure: float) -> float:
    """Return the area between a failure plane and depths of the edge below the surface sampled along it."""
    reach = np.arange(len(depths)) * spacing_m
    thickness = depths - reach * math.tan(failure)
    ends = np.flatnonzero(thickness <= 0)
    if len(ends):
        thickness = thickness[: ends[0]]
    return float(np.sum(thickness) * spacing_m)
