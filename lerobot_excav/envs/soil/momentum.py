"""Speed of the mobile layer: gravity down the slope, momentum, friction on the bed.

Depth-averaged equations of a layer of depth m with a surface h (Savage and Hutter 1989; recalled), on a staggered grid:
du/dt = -u . grad u - g grad h - mu g u / |u|. Friction acts against the whole velocity, not axis by axis, so that the
repose angle is the same in all directions. Momentum is carried as in Stelling and Duinmeijer 2003 (recalled): with the
flux through the faces, upwind, divided by the depth at the face.

A thin layer on a slope at the limit would go on for minutes at a few centimetres per second: the law of friction has no
lower bound of the speed, as real grains have. So soil that has only crept for a while stops, on a slope that is still a
little too steep. That time counts from zero again where soil is changed from outside or a fast flow comes by.
"""

import math

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array, Level, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import Ground, Layer, Window
from lerobot_excav.envs.soil.slope import surface_slope

THINNEST_M = 5e-4
"""A mobile layer thinner than this lies still: a grain."""

START_TAN = 8e-3
"""Slope above the repose slope (tangent) at which soil at rest starts to move (tuned): 0.28 degrees at 39 degrees. Were
it the slope at which it stops, a slope at the limit would creep for ever."""

HOLD_TAN = 2e-2
"""The same of the steepest way down from a single column (tuned): 0.7 degrees at 39 degrees."""

REST_M_S = 1e-2
"""Soil that is slower stops if its slope may rest, and starts with this speed (tuned: it moves 1 mm in 0.1 s)."""

CREEP_M_S = 3e-2
"""Slower soil creeps (tuned: what a thin layer comes to on a slope that is 0.3 degrees too steep). From a column that
is too steep soil goes down at least as fast."""

FAST_M_S = 0.1
"""Faster soil is an avalanche: the soil around it may creep again (tuned)."""

PATIENCE_S = 1.0
"""Soil that has crept for longer stops (tuned), unless it is too steep even for that (`STEEPER_PER_S`)."""

STEEPER_PER_S = 0.05
"""Slope above the repose slope (tangent), per second of creep, up to which soil that has crept stops (tuned)."""

GRAIN_M = 5e-4
"""Diameter of a grain (guess: medium sand)."""

FRICTION_RISE = 0.2
"""Friction of a fast flow above that at rest: mu_2 - mu_s of the mu(I) rheology (`INERTIAL_NUMBER`)."""

INERTIAL_NUMBER = 0.08
"""Inertial number of half of that rise (Chrono::FSI-SPH mu(I) Rheology Parameter Guide,
https://api.projectchrono.org/manual_fsi_mu_i_rheology.html: mu_s 0.8, mu_2 1.0, mu_I0 0.08)."""

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

    It moved at the speed `was` before. Slow soil stops, and soil at rest stays so, where the slope may rest.
    """
    driven, excess = math.sqrt(u * u + v * v), math.sqrt(slope[0] ** 2 + slope[1] ** 2) - slope_tan
    left = driven - dt * GRAVITY_M_S2 * friction(slope_tan, was, depth)
    if driven > 0.0 and slope[2] > slope_tan + HOLD_TAN:
        left = max(left, CREEP_M_S)
    elif left < REST_M_S:
        if excess <= START_TAN or (was > 0.0 and left <= 0.0):
            return 0.0
        if was == 0.0:
            left = REST_M_S
    return u * left / driven if left > 0.0 else 0.0


@kernel
def _crept_s(layer: Layer, p: int, q: int, i: int, j: int) -> float:
    """Return how long [s] soil has crept on both sides of a face; over the border that of the column inside counts."""
    nx, ny = layer.crept_s.shape
    return float(min(layer.crept_s[max(p, 0), max(q, 0)], layer.crept_s[min(i, nx - 1), min(j, ny - 1)]))


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
                slope = surface_slope(heights, ground, axis, i, j)
                if abs(layer.speeds[axis, i, j]) < CREEP_M_S:
                    crept_s = _crept_s(layer, p, q, i, j)
                    if crept_s > PATIENCE_S and slope[2] < ground.slope_tan + STEEPER_PER_S * crept_s:
                        continue
                own, drift = _carried(layer.speeds, layer.flux, ground, axis, i, j, 0.5 * (before + after), dt)
                was = math.sqrt(own * own + drift * drift)
                u, v = own - dt * GRAVITY_M_S2 * slope[0], drift - dt * GRAVITY_M_S2 * slope[1]
                speed = _rubbed(u, v, was, slope, ground.slope_tan, depth, dt)
                if (before if speed > 0.0 else after) > THINNEST_M:
                    layer.next_speeds[axis, i, j] = speed
