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

_TRIALS_RAD = tuple(math.radians(angle) for angle in (24.0, 17.0, 11.0, 6.0, 2.5, 0.0, 32.0))
"""Rise of the trial planes. On level ground the tabulated angle is the best one and is tried before them; before a heap
flat planes are, which differ most. The two planes halfway to the neighbours of the best one are tried last."""

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
def read_profile(
    weighed: Array, grid: Grid, foot: Vector, ahead: Level, profile: Array, known: int, wanted: int
) -> int:
    """Read how far the surface stands above a foot [m] at every cell ahead, as far as wanted; return what is known.

    The surface within one cell of the foot is read one cell ahead: nearer, the tool has taken it already.
    """
    for i in range(known, wanted):
        reach = max(i, 1) * grid.dx
        profile[i] = surface_height(weighed, grid, foot[0] + ahead[0] * reach, foot[1] + ahead[1] * reach) - foot[2]
    return max(known, wanted)


@kernel
def wedge_end(profile: Array, known: int, step: float, slope: float, most: float) -> tuple[float, float, int]:
    """Return area [m2] and reach [m] of the wedge between a plane of some slope and a profile sampled every step.

    It reaches from the foot to where they first meet. The area is infinite if it grows beyond the most; and the third
    number is how much of the profile must be known to go on, or zero at the end.
    """
    area, thickness = 0.0, profile[0]
    for i in range(1, len(profile)):
        if i >= known:
            return area, 0.0, i + 1
        following = profile[i] - i * step * slope
        if following <= 0.0:
            share = thickness / (thickness - following)
            return area + 0.5 * thickness * step * share, (i - 1 + share) * step, 0
        area += 0.5 * (thickness + following) * step
        if area > most:
            return math.inf, i * step, 0
        thickness = following
    return area, (len(profile) - 1) * step, 0


@kernel
def halfway_planes(best: float, tabulated: float) -> tuple[float, float]:
    """Return the angles halfway from the best trial plane to the next flatter and the next steeper one."""
    flatter, steeper = -math.inf, math.inf
    for j in range(-1, len(_TRIALS_RAD)):
        trial = tabulated if j < 0 else _TRIALS_RAD[j]
        if trial < best:
            flatter = max(flatter, trial)
        elif trial > best:
            steeper = min(steeper, trial)
    return 0.5 * (best + max(flatter, 0.0)), 0.5 * (best + min(steeper, 2.0 * best))


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
    profile = np.empty(max(2, 1 + int(_WEDGE_REACH_M / grid.dx)))
    known = read_profile(weighed, grid, foot, ahead, profile, 0, 2)
    if profile[0] <= 0.0:
        return 0.0, 0.0
    rake = min(max(rake, RAKE_MIN_RAD), RAKE_MAX_RAD)
    leaning = min(rake + soil.steel_friction + soil.friction, _STEEPEST_RAD)  # rougher soil would lock before a wall
    extra = 0.5 * profile[0] ** 2 / math.tan(rake) + load / soil.unit_weight
    least, sticking, count = math.inf, 0.0, len(_TRIALS_RAD)
    tabulated = best = failure_angle_at(soil.table, rake)
    flatter, steeper = 0.0, 0.0
    for j in range(-1, count + 2):
        if j == count:
            flatter, steeper = halfway_planes(best, tabulated)
        if j < 0:
            failure = tabulated
        elif j < count:
            failure = _TRIALS_RAD[j]
        else:
            failure = flatter if j == count else steeper
        if leaning + failure > _STEEPEST_RAD:
            continue
        balance = soil.unit_weight * math.sin(failure + soil.friction) / math.sin(leaning + failure)
        slope, most, more = math.tan(failure), least / balance - extra, 1
        while more > 0:
            area, reach, more = wedge_end(profile, known, grid.dx, slope, most)
            known = read_profile(weighed, grid, foot, ahead, profile, known, min(more + 7, len(profile)) if more else 0)
        force = balance * (area + extra)
        if force < least:
            least, best = force, failure
            sticking = soil.cohesion * reach / math.cos(failure) * math.cos(soil.friction) / math.sin(leaning + failure)
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
