"""Speed of the mobile layer: gravity down the slope, momentum, friction on the bed.

Depth-averaged equations of a layer of depth m with a surface h (Savage and Hutter 1989; recalled), on a staggered grid:
du/dt = -u . grad u - g grad h - mu g u / |u|. Friction acts against the whole velocity, not axis by axis, so that the
repose angle is the same in all directions. Momentum is carried as in Stelling and Duinmeijer 2003 (recalled): with the
flux through the faces, upwind, divided by the depth at the face.
"""

import math

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import Ground, Layer, Window

THINNEST_M = 5e-4
"""A mobile layer thinner than this lies still: a grain."""

START_TAN = 8e-3
"""Slope above the repose slope (tangent) at which soil at rest starts to move (tuned): 0.28 degrees at 39 degrees. Were
it the slope at which it stops, a slope at the limit would creep for ever."""

REST_M_S = 1e-2
"""Soil that is slower stops if its slope may rest, and starts with this speed (tuned: it moves 1 mm in 0.1 s)."""

CREEP_M_S = 3e-2
"""Soil that is slower creeps (tuned: above the steady speed of a thin layer on a slope that hardly moves)."""

PATIENCE_S = 1.0
"""Soil that has crept for longer stops (tuned)."""

GRAIN_M = 5e-4
"""Diameter of a grain (guess: medium sand)."""

FRICTION_RISE = 0.2
"""Friction of a fast flow above that at rest: mu_2 - mu_s of the mu(I) rheology (`INERTIAL_NUMBER`)."""

INERTIAL_NUMBER = 0.08
"""Inertial number of half of that rise (Chrono::FSI-SPH mu(I) Rheology Parameter Guide,
https://api.projectchrono.org/manual_fsi_mu_i_rheology.html: mu_s 0.8, mu_2 1.0, mu_I0 0.08)."""

_SAME_SIGN = 1e-9
"""Product of two slopes from which on they point the same way; at a closed border one is zero but for rounding."""

_LEAST_DEPTH_M = 0.02
"""Least depth in the inertial number (tuned): the law is for layers of many grains."""


@kernel
def friction(slope_tan: float, speed: float, depth: float) -> float:
    """Return the friction coefficient of a layer [m] at a speed [m/s] (mu(I): Jop, Forterre, Pouliquen 2006; recalled).

    The inertial number of a layer whose speed grows from its bed as in a chute is 5/2 u d / (m sqrt(g m)).
    """
    m = max(depth, _LEAST_DEPTH_M)
    inertial = 2.5 * speed * GRAIN_M / (m * math.sqrt(GRAVITY_M_S2 * m))
    return slope_tan + FRICTION_RISE * inertial / (inertial + INERTIAL_NUMBER)


@kernel
def _height(heights: Array, i: int, j: int, border_height: float) -> float:
    """Return the height [m] of a column; outside that of the border, or of the nearest column if it is closed."""
    nx, ny = heights.shape
    if 0 <= i < nx and 0 <= j < ny:
        return float(heights[i, j])
    if border_height < math.inf:
        return border_height
    return float(heights[min(max(i, 0), nx - 1), min(max(j, 0), ny - 1)])


@kernel
def _slope(heights: Array, ground: Ground, axis: int, i: int, j: int) -> Vector:
    """Return the slope of the surface at a face, along its axis and across it, and the greatest slope there.

    Across it is the mean of both sides of the face; on a crest or in a valley, where they differ in sign, the steeper
    one: their mean would hide the slope. The greatest slope takes the steeper one everywhere.
    """
    di, dj, border = 1 - axis, axis, ground.border_height
    step, side = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    before, after = _height(heights, i - di, j - dj, border), _height(heights, i, j, border)
    low = _height(heights, i - di - dj, j - dj - di, border) + _height(heights, i - dj, j - di, border)
    high = _height(heights, i - di + dj, j - dj + di, border) + _height(heights, i + dj, j + di, border)
    left, right = (before + after - low) / (2.0 * side), (high - before - after) / (2.0 * side)
    down, steeper = (after - before) / step, left if abs(left) > abs(right) else right
    aside = 0.5 * (left + right) if left * right > _SAME_SIGN else steeper
    return down, aside, math.sqrt(down * down + steeper * steeper)


@kernel
def _carried(speeds: Array, flux: Array, ground: Ground, axis: int, i: int, j: int, depth: float, dt: float) -> Level:
    """Return the speeds [m/s] along the axis of a face and across it after a time [s] of carrying momentum along.

    The depth [m] is the mean of both sides. Nothing flows in over the border, so an inflow comes from a face that
    exists.
    """
    di, dj = 1 - axis, axis
    a, b = max(i - di, 0), max(j - dj, 0)
    c, d = min(i, speeds.shape[1] - 2), min(j, speeds.shape[2] - 2)
    step, side = (ground.dx, ground.dy) if axis == 0 else (ground.dy, ground.dx)
    cross, through = speeds[1 - axis], flux[1 - axis]
    drift = 0.25 * (cross[a, b] + cross[a + dj, b + di] + cross[c, d] + cross[c + dj, d + di])
    own, here = speeds[axis, i, j], flux[axis, i, j]
    west = max(flux[axis, a, b] + here, 0.0) / step if i >= di and j >= dj else 0.0
    east = max(-here - flux[axis, c + di, d + dj], 0.0) / step if c == i and d == j else 0.0
    south = max(through[a, b] + through[c, d], 0.0) / side
    north = max(-through[a + dj, b + di] - through[c + dj, d + di], 0.0) / side
    inflow = west + east + south + north
    if inflow <= 0.0:
        return own, drift
    change = west * (speeds[axis, a, b] - own) + east * (speeds[axis, c + di, d + dj] - own)
    if south > 0.0:
        change += south * (speeds[axis, i - dj, j - di] - own)
    if north > 0.0:
        change += north * (speeds[axis, i + dj, j + di] - own)
    # at most all of the layer at the face is replaced in a sub-step
    return own + change * min(0.5 * dt / depth, 1.0 / inflow), drift


@kernel
def _rubbed(u: float, v: float, was: float, slope: Vector, slope_tan: float, depth: float, dt: float) -> float:
    """Return the part [m/s] of a driven velocity (u, v) along the axis that friction leaves after a time [s].

    It moved at the speed `was` before. Soil at rest stays so where even the greatest slope may rest; slow soil stops
    where the slope may rest.
    """
    driven = math.sqrt(u * u + v * v)
    left = driven - dt * GRAVITY_M_S2 * friction(slope_tan, was, depth)
    if left < REST_M_S:
        if was == 0.0:
            return u * REST_M_S / driven if slope[2] > slope_tan + START_TAN else 0.0
        if left <= 0.0 or math.sqrt(slope[0] ** 2 + slope[1] ** 2) <= slope_tan + START_TAN:
            return 0.0
    return u * left / driven


@kernel
def _is_tired(creeping_s: Array, p: int, q: int, i: int, j: int) -> bool:
    """Tell whether soil has crept for too long on both sides of a face."""
    nx, ny = creeping_s.shape
    a, b, c, d = max(p, 0), max(q, 0), min(i, nx - 1), min(j, ny - 1)
    return bool(creeping_s[a, b] > PATIENCE_S and creeping_s[c, d] > PATIENCE_S)


@kernel
def accelerate(layer: Layer, ground: Ground, window: Window, dt: float) -> None:
    """Fill in `next_speeds` of the faces with a mobile layer around the columns of a window, after a time [s].

    Nothing moves between columns of which one has soil above its ceiling, nor through a closed border.
    """
    heights, bed, ceiling = layer.heights, layer.bed, layer.ceiling
    nx, ny = heights.shape
    closed = ground.border_height == math.inf
    for i in range(window.i0, window.i1 + 1):
        for j in range(window.j0, window.j1 + 1):
            for axis in range(2):
                p, q = i - 1 + axis, j - axis
                is_there, is_before = i < nx and j < ny, p >= 0 and q >= 0
                if p >= nx or q >= ny or (closed and not (is_there and is_before)):
                    continue
                after = heights[i, j] - bed[i, j] if is_there else 0.0
                before = heights[p, q] - bed[p, q] if is_before else 0.0
                depth = max(before, after)
                if depth <= THINNEST_M:
                    continue
                if (is_there and heights[i, j] > ceiling[i, j]) or (is_before and heights[p, q] > ceiling[p, q]):
                    continue
                if abs(layer.speeds[axis, i, j]) < CREEP_M_S and _is_tired(layer.creeping_s, p, q, i, j):
                    continue
                slope = _slope(heights, ground, axis, i, j)
                own, drift = _carried(layer.speeds, layer.flux, ground, axis, i, j, 0.5 * (before + after), dt)
                was = math.sqrt(own * own + drift * drift)
                u, v = own - dt * GRAVITY_M_S2 * slope[0], drift - dt * GRAVITY_M_S2 * slope[1]
                speed = _rubbed(u, v, was, slope, ground.slope_tan, depth, dt)
                if (before if speed > 0.0 else after) > THINNEST_M:
                    layer.next_speeds[axis, i, j] = speed
