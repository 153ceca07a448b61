"""The cutting edge in the ground: the wedge of soil before each lateral slice, and the bearing of the edge itself.

The wedge is weighed in the height field, so heaps and slopes ahead of the bucket count.
"""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.earthmoving import RAKE_MAX_RAD, RAKE_MIN_RAD
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height

EDGE_THICKNESS_M = 0.02
"""Thickness of the cutting edge (guess, typical of 8-t buckets)."""

TEETH_AREA_PER_WIDTH_M = 5 * 0.060 * 0.015 / 0.70
"""Frontal area of the teeth per width of edge: 5 teeth of 60 x 15 mm on 0.7 m (guess, typical of 8-t buckets)."""

FULL_PENETRATION_DEPTH_M = 0.2
"""Depth over which the bearing of the edge grows from 10 to 100 % (AGX Terrain, Unity default)."""

PENETRATION_CAP_N = 30e3
"""Upper limit of the bearing of the whole edge (AGX users' setting for a machine of this class)."""

_WEDGE_REACH_M = 4.0
"""Longest failure plane followed through the height field."""


class SoilStrength(NamedTuple):
    """What the force model knows of a soil."""

    unit_weight: float  # weight of a volume [N/m3]
    friction: float  # friction angle [rad]
    steel_friction: float  # angle of friction between soil and steel [rad]
    cohesion: float  # [Pa]
    bearing_cohesion: float  # bearing factor of the cohesion [1]
    bearing_depth: float  # bearing factor of the depth [1]
    bearing_width: float  # bearing factor of the width [1]
    penetration_scale: float  # factor on the bearing of the cutting edge [1]
    table: Array  # rake, failure angle, cohesion and surcharge factor, see `earthmoving.failure_table`


@kernel
def wedge_area(heights: Array, grid: Grid, edge: Vector, ahead: Level, failure: float) -> float:
    """Return the area [m2] between failure plane and surface ahead of the edge, to where they first meet.

    The surface within one cell of the edge is read one cell ahead: nearer, the bucket has taken it already.
    """
    step = 0.5 * grid.dx
    area, reach = 0.0, 0.0
    thickness = surface_height(heights, grid, edge[0] + ahead[0] * grid.dx, edge[1] + ahead[1] * grid.dx) - edge[2]
    while thickness > 0.0 and reach < _WEDGE_REACH_M:
        reach += step
        level = max(reach, grid.dx)
        x, y = edge[0] + ahead[0] * level, edge[1] + ahead[1] * level
        following = surface_height(heights, grid, x, y) - edge[2] - reach * math.tan(failure)
        if following > 0.0:
            area += 0.5 * (thickness + following) * step
        else:
            area += 0.5 * thickness * step * thickness / (thickness - following)
        thickness = following
    return area


@kernel
def table_row(table: Array, rake: float) -> tuple[float, float, float]:
    """Return failure angle, cohesion factor and surcharge factor at a rake, which is kept inside the table."""
    last = len(table) - 1
    position = (rake - table[0, 0]) / (table[last, 0] - table[0, 0]) * last
    position = min(max(position, 0.0), float(last))
    k = min(int(position), last - 1)
    f = position - k
    return (
        table[k, 1] + f * (table[k + 1, 1] - table[k, 1]),
        table[k, 2] + f * (table[k + 1, 2] - table[k, 2]),
        table[k, 3] + f * (table[k + 1, 3] - table[k, 3]),
    )


@kernel
def wedge_force(
    weighed: Array, grid: Grid, edge: Vector, depth: float, rake: float, ahead: Level, width: float, soil: SoilStrength
) -> float:
    """Return the force [N] at which the soil before one slice of the edge fails; formula in `earthmoving`.

    It stands at the angle of soil-steel friction to the normal of the plate. The soil above the plate is taken
    as level with the surface ahead.
    """
    rake = min(max(rake, RAKE_MIN_RAD), RAKE_MAX_RAD)
    failure, cohesion_factor, _ = table_row(soil.table, rake)
    area = wedge_area(weighed, grid, edge, ahead, failure) + 0.5 * depth**2 / math.tan(rake)
    balance = math.sin(failure + soil.friction) / math.sin(rake + soil.steel_friction + failure + soil.friction)
    return float(soil.unit_weight * area * width * balance + soil.cohesion * depth * width * cohesion_factor)


@kernel
def edge_bearing(depth: float, width: float, soil: SoilStrength) -> float:
    """Return the force [N] at which the ground yields to edge and teeth, without its cap."""
    stress = soil.unit_weight * depth * soil.bearing_depth
    entry = min(1.0, depth / EDGE_THICKNESS_M)
    stress += entry * (
        soil.cohesion * soil.bearing_cohesion + 0.5 * soil.unit_weight * EDGE_THICKNESS_M * soil.bearing_width
    )
    ramp = 0.1 + 0.9 * min(1.0, depth / FULL_PENETRATION_DEPTH_M)
    return soil.penetration_scale * stress * ramp * (EDGE_THICKNESS_M + TEETH_AREA_PER_WIDTH_M) * width


@kernel
def edge_limits(
    heights: Array,
    weighed: Array,
    grid: Grid,
    edges: Array,
    rake: float,
    ahead: Level,
    width: float,
    soil: SoilStrength,
) -> tuple[Array, Array]:
    """Return the forces [N] at which soil fails before each slice of the edge, and at which it yields to the slice.

    Heights are (nx, ny) [m], the weighed ones with everything that lies on the ground and must be lifted with the
    wedge; `edges` are the (n, 3) middles of the slices, z above the rigid floor. The rake of the plate counts from the
    horizontal [rad]; `ahead` is the level unit direction in which soil lies before the edge of this width [m].
    """
    count = len(edges)
    wedges, bearings = np.zeros(count), np.zeros(count)
    for k in range(count):
        edge = (edges[k, 0], edges[k, 1], edges[k, 2])
        if not in_grid(heights, grid, edge[0], edge[1]):
            continue
        x, y = edge[0] + ahead[0] * grid.dx, edge[1] + ahead[1] * grid.dx
        depth = surface_height(heights, grid, x, y) - edge[2]
        if depth > 0.0:
            share = width / count
            wedges[k] = wedge_force(weighed, grid, edge, depth, rake, ahead, share, soil)
            bearings[k] = min(edge_bearing(depth, share, soil), PENETRATION_CAP_N / count)
    return wedges, bearings
