"""Digging resistance on the cutting edge: a wedge before each lateral slice and the bearing of the edge.

The wedge is weighed in the height field itself, so heaps and slopes ahead of the bucket count. It acts when the
bottom plate moves towards its soil side, the bearing when the edge moves ahead. Both fade out with the speed of the
edge and neither ever drives it: the power on the edge is at most zero. Soil that the shell pushes (reversing,
heel contact) gives no force.
"""

import math

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.earthmoving import RAKE_MAX_RAD, RAKE_MIN_RAD, failure_table
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height
from lerobot_excav.envs.soil.parameters import GRAVITY_M_S2, SoilParameters
from lerobot_excav.envs.soil.tool import Tool

Array = NDArray[np.float64]

EDGE_THICKNESS_M = 0.02
"""Thickness of the cutting edge (guess, typical of 8-t buckets)."""

TEETH_AREA_PER_WIDTH_M = 5 * 0.060 * 0.015 / 0.70
"""Frontal area of the teeth per width of edge: 5 teeth of 60 x 15 mm on 0.7 m (guess, typical of 8-t buckets)."""

FULL_PENETRATION_DEPTH_M = 0.2
"""Depth over which the bearing grows from 10 to 100 % (AGX Terrain, Unity default)."""

PENETRATION_CAP_N = 30e3
"""Upper limit of the bearing of the whole edge (AGX users' setting for a machine of this class)."""

FULL_SPEED_M_S = 0.1
"""Speed scale of the fade-out of resistance at rest (AGX activation speed; the tanh is our own)."""

FULL_INCIDENCE = 0.2
"""Share of the speed across the plate from which on the wedge acts fully (guess)."""

_WEDGE_REACH_M = 4.0
"""Longest failure plane followed through the height field."""


def bearing_factors(friction_rad: float) -> tuple[float, float]:
    """Return the bearing capacity factors of depth and of width (Prandtl-Reissner, Vesic 1973)."""
    depth = math.exp(math.pi * math.tan(friction_rad)) * math.tan(math.pi / 4 + friction_rad / 2) ** 2
    return depth, 2.0 * (depth + 1.0) * math.tan(friction_rad)


@kernel
def wedge_area(
    heights: Array, grid: Grid, edge: tuple[float, float, float], ahead: tuple[float, float], failure: float
) -> float:
    """Return the area [m2] between failure plane and surface ahead of the edge, to where they first meet.

    The surface within one cell of the edge is read one cell ahead: nearer, the bucket has taken it already.
    """
    step = 0.5 * grid[2]
    area, reach = 0.0, 0.0
    thickness = (
        surface_height(heights, grid, edge[0] + ahead[0] * grid[2], edge[1] + ahead[1] * grid[2]) - edge[2]
    )
    while thickness > 0.0 and reach < _WEDGE_REACH_M:
        reach += step
        level = max(reach, grid[2])
        x, y = edge[0] + ahead[0] * level, edge[1] + ahead[1] * level
        following = surface_height(heights, grid, x, y) - edge[2] - reach * math.tan(failure)
        if following > 0.0:
            area += 0.5 * (thickness + following) * step
        else:
            area += 0.5 * thickness * step * thickness / (thickness - following)
        thickness = following
    return area


@kernel
def _interpolate(table: Array, rake: float) -> tuple[float, float]:
    """Return failure angle and cohesion factor at a rake inside the evenly spaced table."""
    last = len(table) - 1
    position = (rake - table[0, 0]) / (table[last, 0] - table[0, 0]) * last
    k = min(int(position), last - 1)
    f = position - k
    return table[k, 1] + f * (table[k + 1, 1] - table[k, 1]), table[k, 2] + f * (
        table[k + 1, 2] - table[k, 2]
    )


@kernel
def slice_force(
    heights: Array,
    grid: Grid,
    edge: tuple[float, float, float],
    velocity: Array,
    plate: tuple[Array, Array],
    ahead: tuple[float, float],
    width: float,
    soil: Array,
    table: Array,
    cap: float,
) -> Array:
    """Return the resistance [N] on one slice of the edge, in the world.

    Args:
        heights: (nx, ny) heights [m].
        grid: First cell centre and cell sizes.
        edge: Middle of the slice; z above the rigid floor.
        velocity: (3,) of the edge there [m/s].
        plate: Unit vectors (3,) from the edge up the bottom plate, and across it to its soil side.
        ahead: Level unit direction in which soil lies before the edge.
        width: Width of the slice [m].
        soil: (7,) unit weight, friction, soil-steel friction, cohesion, the two bearing factors and the scale.
        table: (n, 3) rake, failure angle and cohesion factor.
        cap: Upper limit of the bearing [N].
    """
    force = np.zeros(3)
    depth = (
        surface_height(heights, grid, edge[0] + ahead[0] * grid[2], edge[1] + ahead[1] * grid[2]) - edge[2]
    )
    speed = math.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    if depth <= 0.0 or speed < 1e-9 or not in_grid(heights, grid, edge[0], edge[1]):
        return force
    unit = velocity / speed
    along, across = plate
    rake = math.atan2(along[2], -(along[0] * ahead[0] + along[1] * ahead[1]))
    rake = min(max(rake, RAKE_MIN_RAD), RAKE_MAX_RAD)
    failure, cohesion_factor = _interpolate(table, rake)
    area = wedge_area(heights, grid, edge, ahead, failure) + 0.5 * depth**2 / math.tan(rake)
    push = soil[0] * area * width * math.sin(failure + soil[1]) / math.sin(rake + soil[2] + failure + soil[1])
    push += soil[3] * depth * width * cohesion_factor
    incidence = unit[0] * across[0] + unit[1] * across[1] + unit[2] * across[2]
    push *= min(max(incidence / FULL_INCIDENCE, 0.0), 1.0)
    force[0] = -push * math.sin(rake + soil[2]) * ahead[0]
    force[1] = -push * math.sin(rake + soil[2]) * ahead[1]
    force[2] = -push * math.cos(rake + soil[2])
    bearing = soil[0] * depth * soil[4]
    bearing += 0.5 * soil[0] * EDGE_THICKNESS_M * soil[5] * min(1.0, depth / EDGE_THICKNESS_M)
    bearing *= 0.1 + 0.9 * min(1.0, depth / FULL_PENETRATION_DEPTH_M)
    bearing *= soil[6] * (EDGE_THICKNESS_M + TEETH_AREA_PER_WIDTH_M) * width
    bearing = min(bearing, cap)
    ahead_share = -(unit[0] * along[0] + unit[1] * along[1] + unit[2] * along[2])
    force -= unit * bearing * max(ahead_share, 0.0)
    force *= math.tanh(speed / FULL_SPEED_M_S)
    power = force[0] * unit[0] + force[1] * unit[1] + force[2] * unit[2]
    if power > 0.0:
        force -= unit * power
    return force


@kernel
def edge_wrench(
    heights: Array,
    grid: Grid,
    frame: tuple[Array, Array, Array, Array],
    edge_t: tuple[float, float],
    plate: tuple[Array, Array],
    ahead: tuple[float, float],
    width: float,
    slices: int,
    soil: Array,
    table: Array,
) -> tuple[Array, Array]:
    """Add up the slices of the edge.

    Args:
        heights: (nx, ny) heights [m].
        grid: First cell centre and cell sizes.
        frame: Position, rotation, linear and angular velocity of the tool; z above the rigid floor.
        edge_t: x_t and z_t of the cutting edge.
        plate: As in `slice_force`.
        ahead: As in `slice_force`.
        width: Width of the edge [m].
        slices: Number of slices.
        soil: As in `slice_force`.
        table: As in `slice_force`.

    Returns:
        Force [N] and torque about the tool origin [N m], both (3,) in the world.
    """
    position, rotation, linear, angular = frame
    force, torque = np.zeros(3), np.zeros(3)
    arm, velocity = np.zeros(3), np.zeros(3)
    for k in range(slices):
        y = ((k + 0.5) / slices - 0.5) * width
        for a in range(3):
            arm[a] = rotation[a, 0] * edge_t[0] + rotation[a, 1] * y + rotation[a, 2] * edge_t[1]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            velocity[a] = linear[a] + angular[b] * arm[c] - angular[c] * arm[b]
        edge = (position[0] + arm[0], position[1] + arm[1], position[2] + arm[2])
        cap = PENETRATION_CAP_N / slices
        part = slice_force(heights, grid, edge, velocity, plate, ahead, width / slices, soil, table, cap)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            force[a] += part[a]
            torque[a] += arm[b] * part[c] - arm[c] * part[b]
    return force, torque


class DiggingResistance:
    """Force and torque of the soil on a bucket."""

    def __init__(self, parameters: SoilParameters, slices: int) -> None:
        """Tabulate the failure angles of a soil."""
        p = parameters
        self._slices = slices
        self._table = np.array(failure_table(p.friction_angle_rad, p.steel_friction_angle_rad))
        weight = p.density_kg_m3 * GRAVITY_M_S2
        friction = (p.friction_angle_rad, p.steel_friction_angle_rad, p.cohesion_pa)
        self._soil = np.array(
            [weight, *friction, *bearing_factors(p.friction_angle_rad), p.penetration_scale]
        )

    def wrench(self, heights: Array, grid: Grid, tool: Tool, floor_depth_m: float) -> tuple[Array, Array]:
        """Return force [N] and torque about the tool origin [N m], both (3,) in the world."""
        position, rotation = np.array(tool.position_w), np.array(tool.rotation_w)
        position[2] += floor_depth_m
        frame = (position, rotation, np.array(tool.linear_velocity_w), np.array(tool.angular_velocity_w))
        geometry = tool.geometry
        first, second = geometry.profile_t[0], geometry.profile_t[1]
        along_t = np.array([second[0] - first[0], 0.0, second[1] - first[1]])
        along = rotation @ (along_t / np.linalg.norm(along_t))
        across = rotation @ -geometry.planes_t[1, :3]
        force, torque = edge_wrench(
            heights,
            grid,
            frame,
            (float(first[0]), float(first[1])),
            (along, across),
            self._ahead(rotation, along),
            geometry.inner_width_m,
            self._slices,
            self._soil,
            self._table,
        )
        return force, torque

    @staticmethod
    def _ahead(rotation: Array, along: Array) -> tuple[float, float]:
        """Return the level direction half-way between the line of the plate and the outside of the opening."""
        level = -(along + rotation[:, 2])[:2]
        length = float(np.hypot(*level))
        if length < 1e-9:
            return 1.0, 0.0
        return float(level[0] / length), float(level[1] / length)
