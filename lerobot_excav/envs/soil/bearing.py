"""Pressure of the ground on a piece of a face: what stands before it, what it bears, what its blunt front pushes.

The laws and their sources are at the head of `pressure`.
"""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M
from lerobot_excav.envs.soil.wedge import SoilStrength, passive_force

SINKAGE_MODULUS = 1.53e6
"""Pressure at 1 m of sinkage [N/m^(n+2)] of a plate in dry sand; the part that depends on its breadth is below 1 %
(paper: LLL dry sand, Wong, Theory of Ground Vehicles, table of Bekker parameters)."""

SINKAGE_EXPONENT = 1.1
"""Exponent n of the same."""

FALL_REACH_M = 0.5
"""Distance over which the fall of the ground is read (guess: about the breadth of the bucket's bottom)."""

_LEAST_HEIGHT_M = 1e-6
"""Least height of a buried part of a face; against division by zero."""


@kernel
def buried(first: float, last: float) -> tuple[float, float, float]:
    """Return which share of a straight strip is buried, its mean depth, and where its middle is (0 start, 1 end).

    The surface stands `first` above its start and `last` above its end [m].
    """
    if first <= 0.0 and last <= 0.0:
        return 0.0, 0.0, 0.0
    if first >= 0.0 and last >= 0.0:
        return 1.0, 0.5 * (first + last), 0.5
    if first > 0.0:
        share = first / (first - last)
        return share, 0.5 * first, 0.5 * share
    share = last / (last - first)
    return share, 0.5 * last, 1.0 - 0.5 * share


@kernel
def overlap(heights: Array, grid: Grid, x: float, y: float, z: float, normal: Vector) -> float:
    """Return how far the soil before a point of a face stands above it [m]; none beyond the field.

    It is read one cell outside of the face, in so far as the face is upright.
    """
    x, y = x + grid.dx * normal[0], y + grid.dx * normal[1]
    if not in_grid(heights, grid, x, y):
        return -1.0
    return surface_height(heights, grid, x, y) - z


@kernel
def surroundings(heights: Array, grid: Grid, x: float, y: float, forward: Level) -> tuple[float, float]:
    """Return the lowest surface around a point, and the level of the ground there without what was dug away [m].

    They are read ahead, behind, left and right of a bucket. The level is the lower one of the two means of opposite
    sides: that of the slope on a slope, that of the floor in a trench.
    """
    levels = np.zeros(4)
    for k in range(4):
        c, s = (1.0, 0.0) if k == 0 else (-1.0, 0.0) if k == 1 else (0.0, 1.0) if k == 2 else (0.0, -1.0)
        levels[k] = surface_height(
            heights,
            grid,
            x + FALL_REACH_M * (c * forward[0] - s * forward[1]),
            y + FALL_REACH_M * (c * forward[1] + s * forward[0]),
        )
    lowest = min(min(levels[0], levels[1]), min(levels[2], levels[3]))
    return lowest, 0.5 * min(levels[0] + levels[1], levels[2] + levels[3])


@kernel
def bearing_pressure(sinkage: float, depth: float, footing: float, fall: float, soil: SoilStrength) -> float:
    """Return the pressure [Pa] of soil under a face that has sunk in; formulas at the head of `pressure`.

    The depth is that below the lowest ground around, the footing the breadth of bucket that bears, the fall that of
    the ground over `FALL_REACH_M` [m].
    """
    capacity = (
        soil.unit_weight * (depth * soil.bearing_depth + 0.5 * footing * soil.bearing_width)
        + soil.cohesion * soil.bearing_cohesion
    )
    slope = min(max(fall / FALL_REACH_M, 0.0), 1.0)
    return float((1.0 - slope) ** 2 * min(SINKAGE_MODULUS * sinkage**SINKAGE_EXPONENT, capacity))


@kernel
def wedge_pressure(
    weighed: Array, grid: Grid, foot: Vector, top: float, normal: Vector, depth: float, soil: SoilStrength
) -> float:
    """Return the push per area [Pa] of soil before the part of a face between a foot and a top above it (z).

    It is what the wedge before the foot resists more than the one before the top, so a face in pieces resists as a
    whole one. Cohesion counts in full where the soil stands by `PLATE_THICKNESS_M` above the face (depth).
    """
    level = math.sqrt(normal[0] ** 2 + normal[1] ** 2)
    ahead = (normal[0] / level, normal[1] / level)
    rake = math.atan2(level, normal[2])
    weight, sticking = passive_force(weighed, grid, foot, ahead, rake, 0.0, soil)
    over, over_sticking = passive_force(weighed, grid, (foot[0], foot[1], top), ahead, rake, 0.0, soil)
    more = max(0.0, weight - over) + min(1.0, depth / PLATE_THICKNESS_M) * max(0.0, sticking - over_sticking)
    return float(more / max(top - foot[2], _LEAST_HEIGHT_M) * normal_share(level, normal[2], soil))


@kernel
def normal_share(level: float, vertical: float, soil: SoilStrength) -> float:
    """Return how much of a wedge's growth per depth pushes along the normal of the face, per area.

    A face that looks up is met at the angle of friction. One that leans over the soil meets in level motion as much as
    an upright one of its height, by push and friction together.
    """
    if vertical >= 0.0:
        return level * math.cos(soil.steel_friction)
    return level * math.cos(soil.steel_friction) / (level - math.tan(soil.steel_friction) * vertical)


@kernel
def blunt_pressure(depth: float, normal: Vector, soil: SoilStrength) -> float:
    """Return the push per area [Pa] of soil before the blunt edge (Balovnev, see `earthmoving.blunt_edge_factor`)."""
    sine = math.sin(soil.friction)
    entry = min(1.0, depth / PLATE_THICKNESS_M)
    stress = soil.unit_weight * (depth * (1.0 - sine) / (1.0 + sine) + 0.5 * entry * PLATE_THICKNESS_M)
    stress += entry * soil.cohesion / math.tan(soil.friction)
    level = math.sqrt(normal[0] ** 2 + normal[1] ** 2)
    return float(soil.blunt * stress * level / (level + math.tan(soil.steel_friction) * max(0.0, -normal[2])))
