"""The wedge of soil that must fail before a face can move into it: before each slice of the edge, and before plates.

It is weighed in the height field, so heaps and slopes ahead count, and so does the load that lies on it. Of some
trial planes, the one with the least resistance is the failure plane (method of trial wedges, McKyes 1985).
"""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.earthmoving import RAKE_MAX_RAD, RAKE_MIN_RAD
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height

_WEDGE_REACH_M = 4.0
"""Longest failure plane followed through the height field."""

_TRIALS_RAD = tuple(math.radians(a) for a in (0.0, 2.0, 4.0, 7.0, 10.0, 14.0, 18.0, 23.0, 28.0, 34.0, 40.0))
"""Rise of the trial planes. On level ground the tabulated angle is the best one and is tried as well; before a heap
flat planes are, which differ most."""

_STEEPEST_RAD = math.radians(179.0)
"""Largest sum of rake, wall friction, failure and friction angle; at 180 degrees a wedge locks."""


class SoilStrength(NamedTuple):
    """What the force model knows of a soil."""

    unit_weight: float  # weight of a volume [N/m3]
    friction: float  # friction angle [rad]
    steel_friction: float  # angle of friction between soil and steel [rad]
    cohesion: float  # [Pa]
    bearing_cohesion: float  # bearing factor of the cohesion [1]
    bearing_depth: float  # bearing factor of the depth [1]
    bearing_width: float  # bearing factor of the width [1]
    blunt: float  # passive coefficient of a blunt edge [1]
    penetration_scale: float  # factor on the resistance of the blunt edge [1]
    table: Array  # rake, failure angle, cohesion and surcharge factor, see `earthmoving.failure_table`


@kernel
def failure_angle_at(table: Array, rake: float) -> float:
    """Return the failure angle on level ground at a rake, which is kept inside the table."""
    last = len(table) - 1
    position = (rake - table[0, 0]) / (table[last, 0] - table[0, 0]) * last
    position = min(max(position, 0.0), float(last))
    k = min(int(position), last - 1)
    return float(table[k, 1] + (position - k) * (table[k + 1, 1] - table[k, 1]))


@kernel
def trial_wedges(
    weighed: Array, grid: Grid, foot: Vector, ahead: Level, failures: Array, balances: Array, extra: float
) -> Array:
    """Return area [m2] and length of the failure plane [m] of wedges ahead of a foot, (n, 2).

    Each lies between its plane and the surface, from the foot to where these first meet. The surface within one cell
    of the foot is read one cell ahead: nearer, the tool has taken it already. A wedge resists in proportion to its
    balance times its area and the extra one that each has; one that already resists more than a finished one is not
    followed to its end, and gets an infinite area.
    """
    count, step = len(failures), 0.5 * grid.dx
    wedges, thicknesses = np.zeros((count, 2)), np.zeros(count)
    thicknesses[:] = surface_height(weighed, grid, foot[0] + ahead[0] * grid.dx, foot[1] + ahead[1] * grid.dx) - foot[2]
    growing, reach, least = count, 0.0, math.inf
    while growing > 0 and reach < _WEDGE_REACH_M:
        reach += step
        level = max(reach, grid.dx)
        surface = surface_height(weighed, grid, foot[0] + ahead[0] * level, foot[1] + ahead[1] * level) - foot[2]
        growing = 0
        for j in range(count):
            thickness = thicknesses[j]
            if thickness <= 0.0:
                continue
            following = surface - reach * math.tan(failures[j])
            if following > 0.0:
                wedges[j, 0] += 0.5 * (thickness + following) * step
                wedges[j, 1] = reach / math.cos(failures[j])
                growing += 1
                if (wedges[j, 0] + extra) * balances[j] > least:
                    following, wedges[j, 0] = 0.0, math.inf
                    growing -= 1
            else:
                share = thickness / (thickness - following)
                wedges[j, 0] += 0.5 * thickness * step * share
                wedges[j, 1] = (reach - step + step * share) / math.cos(failures[j])
                least = min(least, (wedges[j, 0] + extra) * balances[j])
            thicknesses[j] = following
    return wedges


@kernel
def passive_force(
    weighed: Array, grid: Grid, foot: Vector, ahead: Level, rake: float, load: float, soil: SoilStrength
) -> tuple[float, float]:
    """Return the force per width [N/m] at which the soil before a face fails: by weight, and by cohesion.

    It stands at the angle of soil-steel friction to the normal of the face, which rises from its foot with a rake
    from the horizontal; the soil above the face is taken as level with the surface ahead. For a wedge of weight W
    that carries a load Q and slips on a plane of length l at an angle b,

        P = ((W + Q) sin(b + phi) + c l cos(phi)) / sin(rake + delta + b + phi)

    which on level ground is the fundamental equation of earthmoving (`earthmoving`), with the load as its surcharge
    (as in Luengo, Singh and Cannon 1998). The plane is the one with the least force without cohesion.
    """
    depth = surface_height(weighed, grid, foot[0] + ahead[0] * grid.dx, foot[1] + ahead[1] * grid.dx) - foot[2]
    if depth <= 0.0:
        return 0.0, 0.0
    rake = min(max(rake, RAKE_MIN_RAD), RAKE_MAX_RAD)
    leaning = rake + soil.steel_friction + soil.friction
    failures, balances = np.zeros(len(_TRIALS_RAD) + 1), np.zeros(len(_TRIALS_RAD) + 1)
    failures[0] = failure_angle_at(soil.table, rake)
    for j in range(len(_TRIALS_RAD)):
        failures[j + 1] = _TRIALS_RAD[j]
    for j in range(len(failures)):
        if leaning + failures[j] > _STEEPEST_RAD:
            failures[j] = failures[0]
        balances[j] = math.sin(failures[j] + soil.friction) / math.sin(leaning + failures[j])
    extra = 0.5 * depth**2 / math.tan(rake) + load / soil.unit_weight
    wedges = trial_wedges(weighed, grid, foot, ahead, failures, balances, extra)
    least, best = math.inf, 0
    for j in range(len(failures)):
        force = soil.unit_weight * (wedges[j, 0] + extra) * balances[j]
        if force < least:
            least, best = force, j
    sticking = soil.cohesion * wedges[best, 1] * math.cos(soil.friction) / math.sin(leaning + failures[best])
    return least, sticking


@kernel
def slice_force(
    weighed: Array, grid: Grid, edge: Vector, rakes: Level, ahead: Level, load: float, soil: SoilStrength
) -> float:
    """Return the force per width [N/m] at which the soil before one slice of the edge fails.

    It enters the bucket along the bottom plate under the load; or, where this is easier, load and bucket push it as one
    blunt body with the opening as its face. `rakes` are those of the plate and of the opening. The opening is taken to
    be as rough as steel: a plane wedge before a face as rough as soil overestimates the force.
    """
    rake = min(max(rakes[0], RAKE_MIN_RAD), RAKE_MAX_RAD)
    weight, sticking = passive_force(weighed, grid, edge, ahead, rake, load, soil)
    if load <= 0.0:
        return weight + sticking
    blunt_rake = min(max(rakes[1], RAKE_MIN_RAD), RAKE_MAX_RAD)
    weight_ahead, sticking_ahead = passive_force(weighed, grid, edge, ahead, blunt_rake, 0.0, soil)
    # Both are compared by their level parts: the plate's patch stands for either.
    level = math.sin(blunt_rake + soil.steel_friction) / math.sin(rake + soil.steel_friction)
    return min(weight + sticking, level * (weight_ahead + sticking_ahead))


@kernel
def edge_limits(
    heights: Array,
    weighed: Array,
    grid: Grid,
    edges: Array,
    rakes: Level,
    ahead: Level,
    width: float,
    load: float,
    soil: SoilStrength,
) -> Array:
    """Return the forces [N] at which soil fails before each slice of the edge; formula in `passive_force`.

    Heights are (nx, ny) [m], the weighed ones with everything that lies on the ground and must be lifted with the
    wedge; `edges` are the (n, 3) middles of the slices, z above the rigid floor. The rakes of plate and opening count
    from the horizontal [rad]; `ahead` is the level unit direction in which soil lies before the edge of this width
    [m]; the load is the weight of the soil in the bucket [N].
    """
    count = len(edges)
    wedges = np.zeros(count)
    for k in range(count):
        edge = (edges[k, 0], edges[k, 1], edges[k, 2])
        if not in_grid(heights, grid, edge[0], edge[1]):
            continue
        x, y = edge[0] + ahead[0] * grid.dx, edge[1] + ahead[1] * grid.dx
        if surface_height(heights, grid, x, y) > edge[2]:
            wedges[k] = slice_force(weighed, grid, edge, rakes, ahead, load / width, soil) * width / count
    return wedges
