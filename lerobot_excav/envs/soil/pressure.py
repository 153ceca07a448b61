"""Pressure of the ground on the outer faces of the plates: bottom, back, blunt edge and side plates.

Two laws share the normal of a face. In so far as it is upright, it must move the soil that stands before it: the wedge
of `wedge.passive_force`, weighed in the height field, so a heap that is pushed counts. A face that leans over the soil
pushes a body of dead soil ahead of it (Miedema, ch. 11) and then resists as an upright one of its height. In so far as
it looks down it bears: the pressure grows with the sinkage as Bekker measured (k z^n), up to the bearing capacity
(Vesic 1973). Where the ground falls off beside the face, as on the flanks of a pile, that is lower by the ground factor
(1 - slope)^2 (Vesic 1975). It counts by the square of the downward part of the normal (guess).

The sinkage is how far the soil under a piece has been pressed down. Level travel brings fresh soil under it, whatever
its direction: the sinkage is renewed over the distance from the front of the contact.

The ground meets a plate at its thickness outside of the profile: the cut clears the inside of the plates, so that soil
which touches one reaches as deep into its outer face. The edge is met where it is, by the soil one cell ahead. The
bearing starts from zero at contact.
"""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools, Level, Vector
from lerobot_excav.envs.soil.bearing import (
    bearing_pressure,
    blunt_pressure,
    buried,
    overlap,
    surroundings,
    wedge_pressure,
)
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, surface_height
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces
from lerobot_excav.envs.soil.side_plates import side_limits
from lerobot_excav.envs.soil.sinkage import press_down, renewal_lengths
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.envs.soil.wedge import SoilStrength

_NO_SLOPE = 0.05
"""A face whose normal has a smaller level part is level: it moves no soil aside."""


@kernel
def shell_limits(
    heights: Array,
    weighed: Array,
    grid: Grid,
    starts: Array,
    ends: Array,
    normals: Array,
    is_edge: Bools,
    width: float,
    areas: Array,
    rows: int,
    ways: tuple[Level, Level],
    velocities: Array,
    dt: float,
    sinkages: Array,
    soil: SoilStrength,
) -> tuple[Array, Array]:
    """Return points (m, 3) and greatest pushes (m,) [N] of the soil on the pieces of bottom, back and edge.

    Heights are (nx, ny) [m], the weighed ones with what a wedge must lift; starts, ends and normals as in `OuterFaces`,
    in the world with z above the rigid floor. The ways are the level direction of the bucket, and the one ahead of its
    edge; the velocities (m, 3) are those of the pieces. Sinkages change in place.
    """
    count = len(starts)
    points, limits, footing = np.zeros((count, 3)), np.zeros(count), 0.0
    shares, contacts, depths = np.zeros(count), np.zeros(count), np.zeros(count)
    grounds, falls = np.zeros(count), np.zeros(count)
    fronts = standing(heights, grid, starts, ends, normals, is_edge, ways[1])
    for k in range(count):
        a, b, normal = row(starts, k), row(ends, k), row(normals, k)
        share, depth, middle = row(fronts, k)
        if not is_edge[k]:
            a, b = moved(a, PLATE_THICKNESS_M, normal), moved(b, PLATE_THICKNESS_M, normal)
            share, depth, middle = buried_between(heights, grid, a, b, normal)
        shares[k] = share
        put_between(points, k, a, b, middle)
        if share > 0.0:
            contacts[k] = min(1.0, depth / PLATE_THICKNESS_M)
            lowest, grounds[k] = surroundings(heights, grid, points[k, 0], points[k, 1], ways[0])
            depths[k] = max(0.0, lowest - points[k, 2])
            falls[k] = surface_height(heights, grid, points[k, 0], points[k, 1]) - lowest
            if not is_edge[k]:
                footing += contacts[k] * shares[k] * level_breadth(a, b, normal) / rows
    lengths = renewal_lengths(points, shares, is_edge, mean_row(velocities), width)
    press_down(sinkages, grounds, shares, points[:, 2], velocities, lengths, dt)
    for k in range(count):
        area = areas[k] * (soil.penetration_scale if is_edge[k] else 1.0)
        if shares[k] > 0.0 and normals[k, 2] < 0.0:
            breadth = PLATE_THICKNESS_M if is_edge[k] else footing
            limits[k] = area * shares[k] * contacts[k] * normals[k, 2] ** 2
            limits[k] *= bearing_pressure(sinkages[k], depths[k], breadth, falls[k], soil)
        if fronts[k, 0] > 0.0:
            if shares[k] <= 0.0:
                put_between(points, k, row(starts, k), row(ends, k), fronts[k, 2])
            push = blunt_pressure(fronts[k, 1], row(normals, k), soil)
            if not is_edge[k]:
                push = front_pressure(weighed, grid, starts, ends, normals, fronts, rows, k, soil)
            limits[k] += area * fronts[k, 0] * push
    return points, limits


@kernel
def put_between(points: Array, k: int, start: Vector, end: Vector, share: float) -> None:
    """Put a point (a row of (n, 3)) at some share of the way from a start to an end."""
    for i in range(3):
        points[k, i] = start[i] + share * (end[i] - start[i])


@kernel
def mean_row(array: Array) -> Array:
    """Return the mean (3,) of the rows of an array (n, 3)."""
    mean = np.zeros(3)
    for k in range(len(array)):
        for i in range(3):
            mean[i] += array[k, i] / len(array)
    return mean


@kernel
def row(array: Array, k: int) -> Vector:
    """Return a row of an array (n, 3)."""
    return array[k, 0], array[k, 1], array[k, 2]


@kernel
def moved(point: Vector, distance: float, direction: Vector) -> Vector:
    """Return a point moved by a distance [m] along a unit vector."""
    return (
        point[0] + distance * direction[0],
        point[1] + distance * direction[1],
        point[2] + distance * direction[2],
    )


@kernel
def level_breadth(start: Vector, end: Vector, normal: Vector) -> float:
    """Return how long a piece between two points is as seen from below [m]; 0 if it does not look down."""
    length = math.sqrt((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2 + (end[2] - start[2]) ** 2)
    return length * max(0.0, -normal[2])


@kernel
def buried_between(heights: Array, grid: Grid, start: Vector, end: Vector, normal: Vector) -> Vector:
    """Return what is buried of a piece between two points of an outer face: share, mean depth [m] and middle."""
    first = overlap(heights, grid, start[0], start[1], start[2], normal)
    last = overlap(heights, grid, end[0], end[1], end[2], normal)
    return buried(first, last)


@kernel
def front_pressure(
    weighed: Array,
    grid: Grid,
    starts: Array,
    ends: Array,
    normals: Array,
    fronts: Array,
    rows: int,
    k: int,
    soil: SoilStrength,
) -> float:
    """Return the pressure [Pa] of the wedge before the buried part of a piece; `fronts` are those of `standing`."""
    foot, top = foot_and_top(grid, starts, ends, normals, fronts, rows, k)
    return wedge_pressure(weighed, grid, foot, top, row(normals, k), fronts[k, 1], soil)


@kernel
def standing(
    heights: Array, grid: Grid, starts: Array, ends: Array, normals: Array, is_edge: Bools, ahead: Level
) -> Array:
    """Return how much of each piece has soil standing before it: share, mean depth [m] and middle, as in `buried`.

    Level pieces move no soil aside and have none; before the edge, the soil one cell ahead is read.
    """
    fronts = np.zeros((len(starts), 3))
    for k in range(len(starts)):
        a, b, normal = row(starts, k), row(ends, k), row(normals, k)
        front = (0.0, 0.0, 0.0)
        if is_edge[k]:
            first = overlap(heights, grid, a[0], a[1], a[2], (ahead[0], ahead[1], 0.0))
            front = buried(first, first)
        elif normal[0] ** 2 + normal[1] ** 2 > _NO_SLOPE**2:
            front = buried_between(heights, grid, a, b, normal)
        fronts[k, 0], fronts[k, 1], fronts[k, 2] = front
    return fronts


@kernel
def between(starts: Array, ends: Array, k: int, share: float) -> Vector:
    """Return the point of a piece at a share of the way from its start (k, 3) to its end [m]."""
    return (
        starts[k, 0] + share * (ends[k, 0] - starts[k, 0]),
        starts[k, 1] + share * (ends[k, 1] - starts[k, 1]),
        starts[k, 2] + share * (ends[k, 2] - starts[k, 2]),
    )


@kernel
def foot_and_top(
    grid: Grid, starts: Array, ends: Array, normals: Array, fronts: Array, rows: int, k: int
) -> tuple[Vector, float]:
    """Return the foot of the wedge before the buried part of a piece, and the top of that part (z).

    Below a face that leans over the soil, dead soil fills the space up to the farthest buried point of the row; there
    the wedge begins. Faces that do not lean have it before them.
    """
    level = math.sqrt(normals[k, 0] ** 2 + normals[k, 1] ** 2)
    x, y = normals[k, 0] / level, normals[k, 1] / level
    one = between(starts, ends, k, fronts[k, 2] - 0.5 * fronts[k, 0])
    other = between(starts, ends, k, fronts[k, 2] + 0.5 * fronts[k, 0])
    foot = one if one[2] < other[2] else other
    farthest = 0.0
    if normals[k, 2] < 0.0:
        for j in range(k % rows, len(starts), rows):
            if fronts[j, 0] > 0.0 and x * normals[j, 0] + y * normals[j, 1] > 0.0:
                for end in range(2):
                    point = between(starts, ends, j, fronts[j, 2] + (end - 0.5) * fronts[j, 0])
                    farthest = max(farthest, x * (point[0] - foot[0]) + y * (point[1] - foot[1]))
    # The surface is read one cell ahead of the foot, but next to an inclined face in so far as that is upright.
    farthest -= (1.0 - level) * grid.dx
    return (foot[0] + farthest * x, foot[1] + farthest * y, foot[2]), max(one[2], other[2])


class PlatePressure:
    """Pressure on the plates of one bucket, which remembers how far the soil under each piece was pressed down."""

    def __init__(self, geometry: ToolGeometry, rows: int, soil: SoilStrength) -> None:
        self._faces = OuterFaces.of(geometry, rows)
        self._middles_t = 0.5 * (self._faces.starts_t + self._faces.ends_t)
        self._areas_m2 = self._faces.areas_m2
        self._is_shell = ~self._faces.is_edge
        self._outline_t = geometry.corners_t.reshape(2, -1, 3)
        self._soil = soil
        self._sinkages_m: Array = np.zeros(len(self._faces.starts_t))

    def patches(
        self,
        heights_m: Array,
        weighed_heights_m: Array,
        grid: Grid,
        tool: Tool,
        floor_depth_m: float,
        ahead: Level,
        dt_s: float,
    ) -> tuple[Patches, ...]:
        """Return what the ground holds against shell, edge, right and left side plate.

        Arguments are as in `SoilResistance.react`.

        `ahead` is the level direction in which soil lies before the edge.
        """
        faces, rotation = self._faces, tool.rotation_w
        ground = heights_m, weighed_heights_m, grid
        raised = tool.position_w + np.array([0.0, 0.0, floor_depth_m])
        normals = faces.normals_t @ rotation.T
        points, limits = shell_limits(
            *ground,
            raised + faces.starts_t @ rotation.T,
            raised + faces.ends_t @ rotation.T,
            normals,
            faces.is_edge,
            faces.width_m,
            self._areas_m2,
            faces.rows,
            (_forward(rotation), ahead),
            _velocities(tool, self._middles_t),
            dt_s,
            self._sinkages_m,
            self._soil,
        )
        points[:, 2] -= floor_depth_m
        edge, shell, friction = faces.is_edge, self._is_shell, math.tan(self._soil.steel_friction)
        return (
            Patches.alike(points[shell], -normals[shell], limits[shell], friction, PatchKind.PRESSURE),
            Patches.alike(points[edge], -normals[edge], limits[edge], friction, PatchKind.PENETRATION),
            self._side(ground, rotation, raised, floor_depth_m, 0),
            self._side(ground, rotation, raised, floor_depth_m, 1),
        )

    def _side(
        self, ground: tuple[Array, Array, Grid], rotation: Array, raised: Array, floor_depth_m: float, side: int
    ) -> Patches:
        """Return what the ground holds against the right (0) or left (1) side plate."""
        normal = np.ascontiguousarray(rotation[:, 1]) * (2.0 * side - 1.0)
        points, limits = side_limits(*ground, raised + self._outline_t[side] @ rotation.T, normal, self._soil)
        if not limits.any():
            return Patches.none()
        points[:, 2] -= floor_depth_m
        normals = np.broadcast_to(-normal, points.shape)
        return Patches.alike(points, normals, limits, math.tan(self._soil.steel_friction), PatchKind.PRESSURE)


def _velocities(tool: Tool, points_t: Array) -> Array:
    """Return the velocities (n, 3) [m/s] of points of a tool."""
    arms, (wx, wy, wz) = points_t @ tool.rotation_w.T, tool.angular_velocity_w.tolist()
    x, y, z = arms.T
    turning = np.stack([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x], axis=1)
    return np.asarray(tool.linear_velocity_w + turning)


def _forward(rotation: Array) -> Level:
    """Return the level direction of the plane in which the bucket turns."""
    x, y = float(rotation[1, 1]), float(-rotation[0, 1])
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 1e-9 else (1.0, 0.0)
