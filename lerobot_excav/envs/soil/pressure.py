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
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height
from lerobot_excav.envs.soil.patches import Patches, PatchKind
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.envs.soil.wedge import SoilStrength, passive_force

SINKAGE_MODULUS = 1.53e6
"""Pressure at 1 m of sinkage [N/m^(n+2)] of a plate in dry sand; the part that depends on its breadth is below 1 %
(paper: LLL dry sand, Wong, Theory of Ground Vehicles, table of Bekker parameters)."""

SINKAGE_EXPONENT = 1.1
"""Exponent n of the same."""

FALL_REACH_M = 0.5
"""Distance over which the fall of the ground is read (guess: about the breadth of the bucket's bottom)."""

_SIDE_ROWS, _SIDE_COLUMNS = 3, 2
"""Patches over the buried height and the length of a side plate."""

_NO_SLOPE = 0.05
"""A face whose normal has a smaller level part is level: it moves no soil aside."""

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
def overlap(heights: Array, grid: Grid, x: float, y: float, z: float, normal: Array) -> float:
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
    return levels.min(), 0.5 * min(levels[0] + levels[1], levels[2] + levels[3])


@kernel
def bearing_pressure(sinkage: float, depth: float, footing: float, fall: float, soil: SoilStrength) -> float:
    """Return the pressure [Pa] of soil under a face that has sunk in; formulas at the head of this module.

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
    weighed: Array, grid: Grid, foot: Vector, top: float, normal: Array, depth: float, soil: SoilStrength
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
def blunt_pressure(depth: float, normal: Array, soil: SoilStrength) -> float:
    """Return the push per area [Pa] of soil before the blunt edge (Balovnev, see `earthmoving.blunt_edge_factor`)."""
    sine = math.sin(soil.friction)
    entry = min(1.0, depth / PLATE_THICKNESS_M)
    stress = soil.unit_weight * (depth * (1.0 - sine) / (1.0 + sine) + 0.5 * entry * PLATE_THICKNESS_M)
    stress += entry * soil.cohesion / math.tan(soil.friction)
    level = math.sqrt(normal[0] ** 2 + normal[1] ** 2)
    return float(soil.blunt * stress * level / (level + math.tan(soil.steel_friction) * max(0.0, -normal[2])))


@kernel
def renewal_lengths(points: Array, shares: Array, is_edge: Bools, velocity: Array, width: float) -> Array:
    """Return after how much level travel fresh soil lies under each piece [m].

    It is the distance from the front of the contact, over the buried pieces of the shell, each as wide as a row. The
    edge is a contact of its own, as long as it is thick.
    """
    lengths = np.full(len(points), PLATE_THICKNESS_M)
    speed = math.sqrt(velocity[0] ** 2 + velocity[1] ** 2)
    if speed == 0.0:
        return lengths
    front = -math.inf
    ways = (points[:, 0] * velocity[0] + points[:, 1] * velocity[1]) / speed
    for k in range(len(points)):
        if shares[k] > 0.0 and not is_edge[k]:
            front = max(front, ways[k] + 0.5 * width)
    for k in range(len(points)):
        if not is_edge[k]:
            lengths[k] = max(PLATE_THICKNESS_M, front - ways[k])
    return lengths


@kernel
def press_down(
    sinkages: Array, grounds: Array, shares: Array, zs: Array, velocities: Array, lengths: Array, dt: float
) -> None:
    """Bring sinkages up to date: what the soil under each piece was pressed down, renewed over a length of travel.

    `grounds` is the level of the ground around each (`surroundings`): nothing has sunk in deeper than that.
    """
    for k in range(len(sinkages)):
        if shares[k] <= 0.0:
            sinkages[k] = 0.0
            continue
        travel = dt * math.sqrt(velocities[k, 0] ** 2 + velocities[k, 1] ** 2)
        sunk = math.exp(-travel / lengths[k]) * (sinkages[k] - dt * velocities[k, 2])
        sinkages[k] = min(max(sunk, 0.0), max(grounds[k] - zs[k], 0.0))


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
    points, limits = np.zeros((count, 3)), np.zeros(count)
    shares, contacts, depths = np.zeros(count), np.zeros(count), np.zeros(count)
    grounds, falls = np.zeros(count), np.zeros(count)
    fronts, footing, mean = standing(heights, grid, starts, ends, normals, is_edge, ways[1]), 0.0, np.zeros(3)
    for k in range(count):
        a, b = starts[k], ends[k]
        shares[k], depth, middle = fronts[k]
        if not is_edge[k]:
            a, b = a + PLATE_THICKNESS_M * normals[k], b + PLATE_THICKNESS_M * normals[k]
            first = overlap(heights, grid, a[0], a[1], a[2], normals[k])
            last = overlap(heights, grid, b[0], b[1], b[2], normals[k])
            shares[k], depth, middle = buried(first, last)
        points[k] = a + middle * (b - a)
        mean += velocities[k] / count
        if shares[k] > 0.0:
            contacts[k] = min(1.0, depth / PLATE_THICKNESS_M)
            lowest, grounds[k] = surroundings(heights, grid, points[k, 0], points[k, 1], ways[0])
            depths[k] = max(0.0, lowest - points[k, 2])
            falls[k] = surface_height(heights, grid, points[k, 0], points[k, 1]) - lowest
            if not is_edge[k]:
                length = math.sqrt(np.sum((b - a) ** 2))
                footing += contacts[k] * shares[k] * length * max(0.0, -normals[k, 2]) / rows
    lengths = renewal_lengths(points, shares, is_edge, mean, width)
    press_down(sinkages, grounds, shares, points[:, 2], velocities, lengths, dt)
    for k in range(count):
        area = areas[k] * (soil.penetration_scale if is_edge[k] else 1.0)
        if shares[k] > 0.0 and normals[k, 2] < 0.0:
            breadth = PLATE_THICKNESS_M if is_edge[k] else footing
            bearing = bearing_pressure(sinkages[k], depths[k], breadth, falls[k], soil)
            limits[k] = area * shares[k] * contacts[k] * normals[k, 2] ** 2 * bearing
        if fronts[k, 0] > 0.0:
            if shares[k] <= 0.0:
                points[k] = starts[k] + fronts[k, 2] * (ends[k] - starts[k])
            if is_edge[k]:
                push = blunt_pressure(fronts[k, 1], normals[k], soil)
            else:
                foot, top = foot_and_top(grid, starts, ends, normals, fronts, rows, k)
                push = wedge_pressure(weighed, grid, foot, top, normals[k], fronts[k, 1], soil)
            limits[k] += area * fronts[k, 0] * push
    return points, limits


@kernel
def standing(
    heights: Array, grid: Grid, starts: Array, ends: Array, normals: Array, is_edge: Bools, ahead: Level
) -> Array:
    """Return how much of each piece has soil standing before it: share, mean depth [m] and middle, as in `buried`.

    Level pieces move no soil aside and have none; before the edge, the soil one cell ahead is read.
    """
    fronts = np.zeros((len(starts), 3))
    for k in range(len(starts)):
        a, b, normal = starts[k], ends[k], normals[k]
        if is_edge[k]:
            first = overlap(heights, grid, a[0], a[1], a[2], np.array([ahead[0], ahead[1], 0.0]))
            fronts[k] = buried(first, first)
        elif normal[0] ** 2 + normal[1] ** 2 > _NO_SLOPE**2:
            first = overlap(heights, grid, a[0], a[1], a[2], normal)
            last = overlap(heights, grid, b[0], b[1], b[2], normal)
            fronts[k] = buried(first, last)
    return fronts


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
    one = starts[k] + (fronts[k, 2] - 0.5 * fronts[k, 0]) * (ends[k] - starts[k])
    other = starts[k] + (fronts[k, 2] + 0.5 * fronts[k, 0]) * (ends[k] - starts[k])
    foot = one if one[2] < other[2] else other
    farthest = 0.0
    if normals[k, 2] < 0.0:
        for j in range(k % rows, len(starts), rows):
            if fronts[j, 0] > 0.0 and x * normals[j, 0] + y * normals[j, 1] > 0.0:
                for share in (fronts[j, 2] - 0.5 * fronts[j, 0], fronts[j, 2] + 0.5 * fronts[j, 0]):
                    point = starts[j] + share * (ends[j] - starts[j])
                    farthest = max(farthest, x * (point[0] - foot[0]) + y * (point[1] - foot[1]))
    # The surface is read one cell ahead of the foot, but next to an inclined face in so far as that is upright.
    farthest -= (1.0 - level) * grid.dx
    return (foot[0] + farthest * x, foot[1] + farthest * y, foot[2]), max(one[2], other[2])


@kernel
def side_limits(
    heights: Array, weighed: Array, grid: Grid, corners: Array, normal: Array, soil: SoilStrength
) -> tuple[Array, Array]:
    """Return points (k, 3) and greatest pushes (k,) [N] of the soil on one side plate, by rows over its buried height.

    The corners (n, 3) are those of its outline, in the world with z above the rigid floor.
    """
    points, limits = np.zeros((_SIDE_ROWS * _SIDE_COLUMNS, 3)), np.zeros(_SIDE_ROWS * _SIDE_COLUMNS)
    low, top, surface = math.inf, -math.inf, -math.inf
    for k in range(len(corners)):
        low, top = min(low, corners[k, 2]), max(top, corners[k, 2])
        surface = max(
            surface, corners[k, 2] + overlap(heights, grid, corners[k, 0], corners[k, 1], corners[k, 2], normal)
        )
    level = math.sqrt(normal[0] ** 2 + normal[1] ** 2)
    step = (min(top, surface) - low) / _SIDE_ROWS
    if step <= 0.0 or level < 0.5:  # a bucket that lies on its side is left out
        return points, limits
    for row in range(_SIDE_ROWS):
        one, other = chord(corners, low + (row + 0.5) * step)
        length = math.sqrt(np.sum((other - one) ** 2))
        for column in range(_SIDE_COLUMNS):
            k = row * _SIDE_COLUMNS + column
            points[k] = one + (column + 0.5) / _SIDE_COLUMNS * (other - one)
            x, y, z = points[k]
            depth = overlap(heights, grid, x, y, z - 0.5 * step, normal)
            if depth > 0.0:
                area, foot = length / _SIDE_COLUMNS * step / level, (x, y, z - 0.5 * step)
                limits[k] = area * wedge_pressure(weighed, grid, foot, z + 0.5 * step, normal, depth, soil)
    return points, limits


@kernel
def chord(corners: Array, z: float) -> tuple[Array, Array]:
    """Return the two points where a level line at a height crosses a convex outline of (n, 3) corners."""
    one, other, found = np.zeros(3), np.zeros(3), 0
    for k in range(len(corners)):
        a, b = corners[k], corners[(k + 1) % len(corners)]
        if (a[2] - z) * (b[2] - z) < 0.0 or a[2] == z:
            other = one.copy() if found else other
            one = a if a[2] == z else a + (z - a[2]) / (b[2] - a[2]) * (b - a)
            found += 1
    return one, other


class PlatePressure:
    """Pressure on the plates of one bucket, which remembers how far the soil under each piece was pressed down."""

    def __init__(self, geometry: ToolGeometry, rows: int, soil: SoilStrength) -> None:
        self._faces = OuterFaces.of(geometry, rows)
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
    ) -> tuple[Patches, Patches, Patches]:
        """Return what the ground holds against shell, edge and side plates; arguments as in `SoilResistance.react`.

        `ahead` is the level direction in which soil lies before the edge.
        """
        faces, rotation = self._faces, tool.rotation_w
        ground = heights_m, weighed_heights_m, grid
        raised = tool.position_w + np.array([0.0, 0.0, floor_depth_m])
        arms = 0.5 * (faces.starts_t + faces.ends_t) @ rotation.T
        normals = faces.normals_t @ rotation.T
        velocities = tool.linear_velocity_w + np.cross(tool.angular_velocity_w, arms)
        points, limits = shell_limits(
            *ground,
            raised + faces.starts_t @ rotation.T,
            raised + faces.ends_t @ rotation.T,
            normals,
            faces.is_edge,
            faces.width_m,
            faces.areas_m2,
            faces.rows,
            (_forward(rotation), ahead),
            velocities,
            dt_s,
            self._sinkages_m,
            self._soil,
        )
        points[:, 2] -= floor_depth_m
        edge, shell, friction = faces.is_edge, ~faces.is_edge, math.tan(self._soil.steel_friction)
        return (
            Patches.alike(points[shell], -normals[shell], limits[shell], friction, PatchKind.PRESSURE),
            Patches.alike(points[edge], -normals[edge], limits[edge], friction, PatchKind.PENETRATION),
            Patches.joined(*(self._side(ground, rotation, raised, floor_depth_m, side) for side in (0, 1))),
        )

    def _side(
        self, ground: tuple[Array, Array, Grid], rotation: Array, raised: Array, floor_depth_m: float, side: int
    ) -> Patches:
        """Return what the ground holds against the right (0) or left (1) side plate."""
        normal = np.ascontiguousarray(rotation[:, 1]) * (2.0 * side - 1.0)
        points, limits = side_limits(*ground, raised + self._outline_t[side] @ rotation.T, normal, self._soil)
        points[:, 2] -= floor_depth_m
        normals = np.broadcast_to(-normal, points.shape)
        return Patches.alike(points, normals, limits, math.tan(self._soil.steel_friction), PatchKind.PRESSURE)


def _forward(rotation: Array) -> Level:
    """Return the level direction of the plane in which the bucket turns."""
    x, y = float(rotation[1, 1]), float(-rotation[0, 1])
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 1e-9 else (1.0, 0.0)
