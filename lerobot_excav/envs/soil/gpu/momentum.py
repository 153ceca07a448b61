"""Speed of the mobile layer of many worlds: `momentum.accelerate` as a kernel of NVIDIA Warp.

The same equations in the same order, one thread for each face of each world. No face reads what another one writes, so
the result does not depend on the order of the threads.
"""

import warp as wp

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil import momentum, slope
from lerobot_excav.envs.soil.layer import Ground

Real = wp.float64
Columns = wp.array3d(dtype=wp.float64)
"""(worlds, nx, ny)"""
Faces = wp.array4d(dtype=wp.float64)
"""(worlds, 2, nx + 1, ny + 1), as in `Layer`"""

ZERO, HALF, TWO = wp.constant(Real(0.0)), wp.constant(Real(0.5)), wp.constant(Real(2.0))
QUARTER, ONE = wp.constant(Real(0.25)), wp.constant(Real(1.0))
GRAVITY = wp.constant(Real(GRAVITY_M_S2))
THINNEST = wp.constant(Real(momentum.THINNEST_M))
START, HOLD = wp.constant(Real(momentum.START_TAN)), wp.constant(Real(momentum.HOLD_TAN))
REST, CREEP = wp.constant(Real(momentum.REST_M_S)), wp.constant(Real(momentum.CREEP_M_S))
PATIENCE, STEEPER = wp.constant(Real(momentum.PATIENCE_S)), wp.constant(Real(momentum.STEEPER_PER_S))
GRAIN, RISE = wp.constant(Real(2.5 * momentum.GRAIN_M)), wp.constant(Real(momentum.FRICTION_RISE))
# The same numbers as there.
INERTIAL = wp.constant(Real(momentum.INERTIAL_NUMBER))
LEAST_DEPTH = wp.constant(Real(momentum._LEAST_DEPTH_M))  # noqa: SLF001
SAME_SIGN, ASIDE = wp.constant(Real(slope._SAME_SIGN)), wp.constant(Real(slope._FARTHEST_ASIDE))  # noqa: SLF001


@wp.struct
class Field:
    """The ground of all worlds: see `Ground`."""

    slope_tan: wp.float64
    dx: wp.float64
    dy: wp.float64
    border_height: wp.float64


@wp.func
def _height(heights: Columns, world: int, i: int, j: int, border_height: wp.float64) -> wp.float64:
    nx, ny = heights.shape[1], heights.shape[2]
    if i >= 0 and j >= 0 and i < nx and j < ny:
        return heights[world, i, j]
    if wp.isfinite(border_height):
        return border_height
    return heights[world, wp.clamp(i, 0, nx - 1), wp.clamp(j, 0, ny - 1)]


@wp.func
def _surface_slope(heights: Columns, world: int, field: Field, axis: int, i: int, j: int) -> wp.vec3d:
    di, dj, border = 1 - axis, axis, field.border_height
    step, side = wp.where(axis == 0, field.dx, field.dy), wp.where(axis == 0, field.dy, field.dx)
    before, after = _height(heights, world, i - di, j - dj, border), _height(heights, world, i, j, border)
    low_before = _height(heights, world, i - di - dj, j - dj - di, border)
    low_after = _height(heights, world, i - dj, j - di, border)
    high_before = _height(heights, world, i - di + dj, j - dj + di, border)
    high_after = _height(heights, world, i + dj, j + di, border)
    left = (before + after - (low_before + low_after)) / (TWO * side)
    right = ((high_before + high_after) - before - after) / (TWO * side)
    aside = right
    if wp.abs(left) > wp.abs(right):
        aside = left
    if left * right > SAME_SIGN:
        aside = HALF * (left + right)
    down = (after - before) / step
    drop = after - wp.min(low_after, high_after)
    if before < after:
        drop = before - wp.min(low_before, high_before)
    turned = wp.min(wp.max(drop, ZERO) / side, ASIDE * wp.abs(down))
    return wp.vec3d(down, aside, wp.sqrt(down * down + turned * turned))


@wp.func
def _carried(
    speeds: Faces, flux: Faces, world: int, field: Field, axis: int, i: int, j: int, depth: wp.float64, dt: wp.float64
) -> wp.vec2d:
    di, dj, other = 1 - axis, axis, 1 - axis
    a, b = wp.max(i - di, 0), wp.max(j - dj, 0)
    c, d = wp.min(i, speeds.shape[2] - 2), wp.min(j, speeds.shape[3] - 2)
    step, side = wp.where(axis == 0, field.dx, field.dy), wp.where(axis == 0, field.dy, field.dx)
    drift = QUARTER * (
        speeds[world, other, a, b]
        + speeds[world, other, a + dj, b + di]
        + speeds[world, other, c, d]
        + speeds[world, other, c + dj, d + di]
    )
    own, here = speeds[world, axis, i, j], flux[world, axis, i, j]
    west, east = ZERO, ZERO
    if i >= di and j >= dj:
        west = wp.max(flux[world, axis, a, b] + here, ZERO) / step
    if c == i and d == j:
        east = wp.max(-here - flux[world, axis, c + di, d + dj], ZERO) / step
    south = wp.max(flux[world, other, a, b] + flux[world, other, c, d], ZERO) / side
    north = wp.max(-flux[world, other, a + dj, b + di] - flux[world, other, c + dj, d + di], ZERO) / side
    inflow = west + east + south + north
    if inflow <= ZERO:
        return wp.vec2d(own, drift)
    # Warp reads both sides of a product, so a face outside of the array is not to be named where nothing comes from it.
    change = west * (speeds[world, axis, a, b] - own)
    if east > ZERO:
        change += east * (speeds[world, axis, c + di, d + dj] - own)
    if south > ZERO:
        change += south * (speeds[world, axis, i - dj, j - di] - own)
    if north > ZERO:
        change += north * (speeds[world, axis, i + dj, j + di] - own)
    return wp.vec2d(own + change * wp.min(HALF * dt / depth, ONE / inflow), drift)


@wp.func
def _friction(slope_tan: wp.float64, speed: wp.float64, depth: wp.float64) -> wp.float64:
    m = wp.max(depth, LEAST_DEPTH)
    inertial = GRAIN * speed / (m * wp.sqrt(GRAVITY * m))
    return slope_tan + RISE * inertial / (inertial + INERTIAL)


@wp.func
def _rubbed(
    u: wp.float64,
    v: wp.float64,
    was: wp.float64,
    steep: wp.vec3d,
    slope_tan: wp.float64,
    depth: wp.float64,
    dt: wp.float64,
) -> wp.float64:
    driven = wp.sqrt(u * u + v * v)
    excess = wp.sqrt(steep[0] * steep[0] + steep[1] * steep[1]) - slope_tan
    left = driven - dt * GRAVITY * _friction(slope_tan, was, depth)
    if driven > ZERO and steep[2] > slope_tan + HOLD:
        left = wp.max(left, CREEP)
    elif left < REST:
        if excess <= START or (was > ZERO and left <= ZERO):
            return ZERO
        if was == ZERO:
            left = REST
    if left > ZERO:
        return u * left / driven
    return ZERO


@wp.kernel
def _accelerate(
    heights: Columns,
    bed: Columns,
    ceiling: Columns,
    crept_s: Columns,
    speeds: Faces,
    flux: Faces,
    field: Field,
    dt_s: wp.array(dtype=wp.float64),
    next_speeds: Faces,
):
    world, axis, i, j = wp.tid()
    dt = dt_s[world]
    nx, ny = heights.shape[1], heights.shape[2]
    p, q = i - 1 + axis, j - axis
    is_there, is_before = i < nx and j < ny, p >= 0 and q >= 0
    if p >= nx or q >= ny or (not wp.isfinite(field.border_height) and not (is_there and is_before)):
        return
    before, after, is_covered = ZERO, ZERO, False
    if is_there:
        after = heights[world, i, j] - bed[world, i, j]
        is_covered = heights[world, i, j] > ceiling[world, i, j]
    if is_before:
        before = heights[world, p, q] - bed[world, p, q]
        is_covered = is_covered or heights[world, p, q] > ceiling[world, p, q]
    depth = wp.max(before, after)
    if depth <= THINNEST or is_covered:
        return
    steep = _surface_slope(heights, world, field, axis, i, j)
    if wp.abs(speeds[world, axis, i, j]) < CREEP:
        crept = wp.min(crept_s[world, wp.max(p, 0), wp.max(q, 0)], crept_s[world, wp.min(i, nx - 1), wp.min(j, ny - 1)])
        if crept > PATIENCE and steep[2] < field.slope_tan + STEEPER * crept:
            return
    carried = _carried(speeds, flux, world, field, axis, i, j, HALF * (before + after), dt)
    own, drift = carried[0], carried[1]
    was = wp.sqrt(own * own + drift * drift)
    u, v = own - dt * GRAVITY * steep[0], drift - dt * GRAVITY * steep[1]
    speed = _rubbed(u, v, was, steep, field.slope_tan, depth, dt)
    source = after
    if speed > ZERO:
        source = before
    if source > THINNEST:
        next_speeds[world, axis, i, j] = speed


def accelerate(
    heights: wp.array,
    bed: wp.array,
    ceiling: wp.array,
    crept_s: wp.array,
    speeds: wp.array,
    flux: wp.array,
    ground: Ground,
    dt_s: wp.array,
    next_speeds: wp.array,
) -> None:
    """Fill in `next_speeds` of all faces of all worlds after a time [s], on the device that holds the arrays.

    Args:
        heights: Surface above the floor, (worlds, nx, ny) float64 [m].
        bed: Static soil, alike [m].
        ceiling: Height up to which soil can flow, alike [m].
        crept_s: How long soil has moved there, alike [s].
        speeds: Of the mobile layer across the faces, (worlds, 2, nx + 1, ny + 1) float64 [m/s].
        flux: Of the same faces, alike [m2/s].
        ground: What flows, the same in all worlds.
        dt_s: Sub-step of each world, (worlds,) float64 [s].
        next_speeds: As `speeds`; faces at which nothing moves stay as they are.
    """
    field = Field()
    field.slope_tan, field.dx, field.dy = ground.slope_tan, ground.dx, ground.dy
    field.border_height = ground.border_height
    inputs = [heights, bed, ceiling, crept_s, speeds, flux, field, dt_s]
    wp.launch(_accelerate, dim=speeds.shape, inputs=inputs, outputs=[next_speeds], device=heights.device)
