"""The swept bucket in a height field: soil enters through the opening or is pushed aside by the shell.

The inside of the bucket is a convex polytope of half-spaces n . q <= d (`ToolGeometry.planes_t`), so a vertical
line crosses it in one exact interval at any pose. Soil inside that interval is sampled in vertical bins. The
motion of a sample relative to the tool tells through which face it came: opening or plate.
"""

import math

from lerobot_excav.envs.soil.arrays import Array, Flags, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid
from lerobot_excav.envs.soil.layer import Window, mark_around
from lerobot_excav.envs.soil.motion import Pose
from lerobot_excav.envs.soil.parcels.birth import Bins, gather

OPENING = 0
"""Index of the opening among the planes of a tool."""

ALREADY_INSIDE = -1

_LEVEL = 0.3
"""A face whose outward normal has a smaller horizontal part pushes soil along the motion instead (guess)."""

_SHIFT_X, _SHIFT_Y = math.sqrt(2.0) - 1.0, 0.5 * (math.sqrt(5.0) - 1.0)
"""By how much of a cell the line of a column moves from row to row. Multiples of an irrational number are spread evenly
over a cell (Weyl's equidistribution), and so are those of the difference and the sum, along the diagonals (guess)."""


@kernel
def column_line(grid: Grid, i: int, j: int) -> Level:
    """Return where the line stands that decides whether a column is inside of a bucket [m]: within its cell."""
    x, y = _SHIFT_X * j, _SHIFT_Y * i
    return grid.x0 + (i + (x - math.floor(x)) - 0.5) * grid.dx, grid.y0 + (j + (y - math.floor(y)) - 0.5) * grid.dy


@kernel
def to_tool(position: Array, rotation: Array, x: float, y: float, z: float) -> Vector:
    """Turn a world point into the tool frame."""
    a, b, c = x - position[0], y - position[1], z - position[2]
    return (
        rotation[0, 0] * a + rotation[1, 0] * b + rotation[2, 0] * c,
        rotation[0, 1] * a + rotation[1, 1] * b + rotation[2, 1] * c,
        rotation[0, 2] * a + rotation[1, 2] * b + rotation[2, 2] * c,
    )


@kernel
def column_interval(planes: Array, position: Array, rotation: Array, x: float, y: float) -> tuple[float, float, int]:
    """Return the heights between which a vertical line is inside the bucket, and the face at the upper end.

    The interval is empty (low >= high) if the line misses the bucket.
    """
    q = to_tool(position, rotation, x, y, 0.0)
    low, high, top = -math.inf, math.inf, ALREADY_INSIDE
    for k in range(len(planes)):
        rest = planes[k, 3] - planes[k, 0] * q[0] - planes[k, 1] * q[1] - planes[k, 2] * q[2]
        rate = planes[k, 0] * rotation[2, 0] + planes[k, 1] * rotation[2, 1] + planes[k, 2] * rotation[2, 2]
        if rate > 1e-12:
            if rest / rate < high:
                high, top = rest / rate, k
        elif rate < -1e-12:
            low = max(low, rest / rate)
        elif rest < 0.0:
            return 0.0, 0.0, top
    return low, high, top


@kernel
def crossed_face(planes: Array, before: Vector, now: Vector) -> int:
    """Return the face through which a point came inside, or `ALREADY_INSIDE`; points are in the tool frame."""
    face, latest = ALREADY_INSIDE, -1.0
    for k in range(len(planes)):
        n0, n1, n2, d = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3]
        outside_before = n0 * before[0] + n1 * before[1] + n2 * before[2] - d
        outside_now = n0 * now[0] + n1 * now[1] + n2 * now[2] - d
        if outside_before > 0.0:
            crossing = outside_before / max(outside_before - outside_now, 1e-300)
            if crossing > latest:
                face, latest = k, crossing
    return face


@kernel
def is_covered(surface: float, grid: Grid, planes: Array, pose: Pose, i: int, j: int) -> bool:
    """Tell whether a surface height of a column lies inside the bucket or above it."""
    x, y = column_line(grid, i, j)
    low, high, _ = column_interval(planes, pose.position, pose.rotation, x, y)
    return low < high and surface > low


@kernel
def push_aside(
    heights: Array, active: Flags, grid: Grid, planes: Array, pose: Pose, start: Level, direction: Level, volume: float
) -> float:
    """Put a loose volume on the first column along a level direction that has room for it beside or below the bucket.

    Returns the volume if that column lies beyond the border, else 0.
    """
    x, y = start
    while True:
        if not in_grid(heights, grid, x, y):
            return volume
        i = int((x - grid.x0) / grid.dx + 0.5)
        j = int((y - grid.y0) / grid.dy + 0.5)
        raised = heights[i, j] + volume / (grid.dx * grid.dy)
        if not is_covered(raised, grid, planes, pose, i, j):
            heights[i, j] = raised
            mark_around(active, i, j)
            return 0.0
        x += direction[0] * grid.dx
        y += direction[1] * grid.dy


@kernel
def _level_unit(rotation: Array, vector: Vector) -> tuple[float, float, float]:
    """Turn a tool vector into the world; return its level part as a unit vector and the length of that part."""
    a = rotation[0, 0] * vector[0] + rotation[0, 1] * vector[1] + rotation[0, 2] * vector[2]
    b = rotation[1, 0] * vector[0] + rotation[1, 1] * vector[1] + rotation[1, 2] * vector[2]
    length = math.sqrt(a * a + b * b)
    if length < 1e-12:
        return 1.0, 0.0, 0.0
    return a / length, b / length, length


@kernel
def push_direction(planes: Array, rotation: Array, face: int, before: Vector, now: Vector) -> Level:
    """Return the level unit direction in which soil is pushed aside.

    A plate pushes along its outward normal. Soil that finds no room behind the opening is pushed along the
    motion of the tool there, and so is soil under a nearly level plate.
    """
    if face != OPENING:
        x, y, length = _level_unit(rotation, (planes[face, 0], planes[face, 1], planes[face, 2]))
        if length > _LEVEL:
            return x, y
    x, y, length = _level_unit(rotation, (before[0] - now[0], before[1] - now[1], before[2] - now[2]))
    if length > 0.0:
        return x, y
    x, y, length = _level_unit(rotation, (planes[face, 0], planes[face, 1], planes[face, 2]))
    return x, y


@kernel
def _taken(volume: float, room: float, fade: float) -> float:
    """Return how much of a volume before the opening enters [m3]."""
    return min(volume * min(1.0, max(0.0, room) / fade), room)


@kernel
def _take_above(
    heights: Array, firm: Array, swell: float, i: int, j: int, low: float, area: float, room: float, fade: float
) -> float:
    """Lower a column towards `low` [m] as far as there is room; return the volume taken [m3], as in the ground."""
    above = max(0.0, heights[i, j] - low)
    from_firm = min(above, max(0.0, firm[i, j] - low))
    volume = (from_firm + (above - from_firm) / swell) * area
    taken = _taken(volume, room, fade)
    if taken > 0.0:
        heights[i, j] = max(low, heights[i, j] - above * taken / volume)
        firm[i, j] -= from_firm * taken / volume
    return taken


@kernel
def cut_column(
    heights: Array,
    firm: Array,
    swell: float,
    active: Flags,
    grid: Grid,
    planes: Array,
    pose_before: Pose,
    pose_now: Pose,
    i: int,
    j: int,
    samples: int,
    room: float,
    fade: float,
    intake: Bins,
) -> tuple[float, float]:
    """Clear one column of the soil inside the bucket; return the volumes that entered and that left the grid."""
    x, y = column_line(grid, i, j)
    low, high, top = column_interval(planes, pose_now.position, pose_now.rotation, x, y)
    low, high = max(low, 0.0), min(high, heights[i, j])
    if high <= low:
        return 0.0, 0.0
    area, entered, lost = grid.dx * grid.dy, 0.0, 0.0
    from_firm = max(0.0, min(high, firm[i, j]) - low)
    share = (from_firm + (high - low - from_firm) / swell) / samples * area  # as in the ground
    firm[i, j] -= from_firm
    # the column sinks first, so that no pushed soil comes to rest on what is being taken away
    heights[i, j] = max(0.0, heights[i, j] - (high - low))
    mark_around(active, i, j)
    for b in range(samples):
        z = low + (b + 0.5) * (high - low) / samples
        before = to_tool(pose_before.position, pose_before.rotation, x, y, z)
        now = to_tool(pose_now.position, pose_now.rotation, x, y, z)
        face = crossed_face(planes, before, now)
        if face == ALREADY_INSIDE:
            face = top  # it fell in from above
        taken = _taken(share, room - entered, fade) if face == OPENING else 0.0
        if taken > 0.0:
            gather(intake, now[0], now[1], now[2], taken)
            entered += taken
        if taken < share:
            direction = push_direction(planes, pose_now.rotation, face, before, now)
            volume = swell * (share - taken)
            lost += push_aside(heights, active, grid, planes, pose_now, (x, y), direction, volume) / swell
    if top == OPENING:
        # What was above the opening has sunk to where it is open below. It must not wait for the next sub-step: the
        # plate may have risen above it by then.
        taken = _take_above(heights, firm, swell, i, j, low, area, room - entered, fade)
        if taken > 0.0:
            now = to_tool(pose_now.position, pose_now.rotation, x, y, low)
            gather(intake, now[0], now[1], now[2], taken)
            entered += taken
    return entered, lost


@kernel
def cut(
    heights: Array,
    firm: Array,
    swell: float,
    active: Flags,
    grid: Grid,
    planes: Array,
    pose_before: Pose,
    pose_now: Pose,
    window: Window,
    samples: int,
    room: float,
    fade: float,
    intake: Bins,
) -> tuple[float, float]:
    """Move the bucket through the soil by one sub-step; heights [m], avalanche marks and `intake` change in place.

    The window holds the bucket at the end, and each of its columns is looked at in so many vertical samples. The bucket
    can still take a volume `room` [m3], and over the last `fade` [m3] of it ever less of what meets the opening.
    Returns the volumes [m3] that entered and that were pushed over the border. All are volumes in the ground; the soil
    above `firm` [m] is loose and has swelled.
    """
    entered, lost = 0.0, 0.0
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            if heights[i, j] > 0.0:
                more, over = cut_column(
                    heights,
                    firm,
                    swell,
                    active,
                    grid,
                    planes,
                    pose_before,
                    pose_now,
                    i,
                    j,
                    samples,
                    room - entered,
                    fade,
                    intake,
                )
                entered += more
                lost += over
    return entered, lost


@kernel
def set_ceiling(
    heights: Array, active: Flags, ceiling: Array, grid: Grid, planes: Array, pose: Pose, window: Window
) -> None:
    """Set the ceiling of the columns of a window to the underside of the bucket, or to infinity beside it.

    The plates thereby hold back avalanches that the height field alone would let through them.
    """
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            x, y = column_line(grid, i, j)
            low, high, _ = column_interval(planes, pose.position, pose.rotation, x, y)
            new = low if low < high else math.inf
            if new != ceiling[i, j] and (new < heights[i, j] + grid.dx or ceiling[i, j] < heights[i, j] + grid.dx):
                mark_around(active, i, j)
            ceiling[i, j] = new
