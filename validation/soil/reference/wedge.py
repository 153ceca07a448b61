"""Twin of `wedge`: the soil above a failure plane, and the plane with the least resistance."""

import math
from collections.abc import Callable

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


def least_force_n_m(
    depth_at: Callable[[Array], Array], rake: float, friction: float, steel: float, unit_weight: float, load_n_m: float
) -> float:
    """Return the least force per width [N/m] of wedges before a face, on planes of every fifth of a degree.

    `depth_at` gives the depth of the foot below the surface at some reach ahead [m]; soil above the face is level with
    the surface at no reach. Force balance of a rigid wedge: weight, load, push and reaction of the ground.
    """
    reach = np.asarray(np.arange(0.0, 4.0, 0.001), dtype=np.float64)
    depths, least = depth_at(reach), math.inf
    for failure in np.radians(np.arange(0.0, 60.0, 0.2)):
        if rake + steel + friction + failure > math.radians(179.0):
            break
        weight = unit_weight * (wedge_area(depths, 0.001, failure) + 0.5 * depths[0] ** 2 / math.tan(rake)) + load_n_m
        # Push P at (sin, cos)(rake + steel) and reaction R at (-sin, cos)(failure + friction) carry the weight.
        sides = [
            [math.sin(rake + steel), -math.sin(failure + friction)],
            [math.cos(rake + steel), math.cos(failure + friction)],
        ]
        least = min(least, float(np.linalg.solve(sides, [0.0, weight])[0]))
    return least
