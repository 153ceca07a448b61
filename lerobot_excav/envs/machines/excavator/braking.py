"""How much of each patch of soil acts on the joints during one substep.

A patch ends the approach of its point along its normal, within its limit, and rubs across the normal. Which patches
hold and which yield is decided by the joint velocities v at the end of the substep, which minimise

    (v - v0) M (v - v0) / 2 + sum of limit h(approach) + grip h(sliding)

with v0 the velocities without soil, M the effective inertia, and h the speed rounded off below `CREEP_SPEED_M_S`.
The function is convex, and Newton's method finds its minimum on the few joints. It is solved twice: the pushes found
without friction, times the friction coefficients, are the grips of the second solution. (Relaxing patch by patch,
projected Gauss-Seidel, took hundreds of sweeps whenever a stalled bucket touched soil at many points.)

A resistance solved this way stops a motion, holds it and never reverses it, and its work is never positive.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.compiled import kernel

Array = NDArray[np.float64]

CREEP_SPEED_M_S = 1e-5
"""Speed at which a patch gives its full force (tuned): a stalled bucket creeps by less."""

_STEPS = 40
"""Bound on Newton's steps; a stalled bucket with fifty patches takes some ten."""

_TOLERANCE = 1e-13
"""Step at which the joint velocities have settled [rad/s]."""

_BISECTIONS = 60
_FLATNESS = 0.1
"""How often a step is bisected to find the lowest point along it, and the share of the slope that may be left."""


@kernel
def solved(matrix: Array, right: Array) -> Array:
    """Solve a small symmetric positive definite system by Gaussian elimination."""
    size = len(right)
    work, x = matrix.copy(), right.copy()
    for k in range(size):
        for i in range(k + 1, size):
            factor = work[i, k] / work[k, k]
            for j in range(k, size):
                work[i, j] -= factor * work[k, j]
            x[i] -= factor * x[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            x[k] -= work[k, j] * x[j]
        x[k] /= work[k, k]
    return x


@kernel
def patch_rows(jacobian: Array, rotation: Array, points_t: Array, axes_t: Array) -> Array:
    """Return the speed of the points of the patches along their axes per joint rate, (k, 3, n).

    Args:
        jacobian: (6, n) of the tool origin: linear, then angular velocity in the world.
        rotation: (3, 3) of the tool.
        points_t: (k, 3) in the tool frame [m].
        axes_t: (k, 3, 3) normal and two tangents of each patch as rows, in the tool frame.
    """
    joints = jacobian.shape[1]
    rows = np.zeros((len(points_t), 3, joints))
    motion = np.zeros((6, joints))
    for a in range(3):
        for j in range(joints):
            for b in range(3):
                motion[a, j] += rotation[b, a] * jacobian[b, j]
                motion[3 + a, j] += rotation[b, a] * jacobian[3 + b, j]
    velocity = np.zeros(3)
    for k in range(len(points_t)):
        for j in range(joints):
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                velocity[a] = motion[a, j] + motion[3 + b, j] * points_t[k, c] - motion[3 + c, j] * points_t[k, b]
            for row in range(3):
                for a in range(3):
                    rows[k, row, j] += axes_t[k, row, a] * velocity[a]
    return rows


@kernel
def patch_speeds(rows: Array, velocity: Array) -> Array:
    """Return the speeds of the points of the patches along their axes, (k, 3) [m/s]."""
    count, axes, joints = rows.shape
    result = np.zeros((count, axes))
    for k in range(count):
        for a in range(axes):
            for j in range(joints):
                result[k, a] += rows[k, a, j] * velocity[j]
    return result


@kernel
def patch_impulses(speeds: Array, limits: Array, grips: Array) -> Array:
    """Return the impulse of each patch along its axes at given speeds, (k, 3) [N s]."""
    result = np.zeros((len(limits), 3))
    for k in range(len(limits)):
        if speeds[k, 0] < 0.0:
            result[k, 0] = limits[k] * min(1.0, -speeds[k, 0] / CREEP_SPEED_M_S)
        if grips[k] > 0.0:
            sliding = np.sqrt(speeds[k, 1] ** 2 + speeds[k, 2] ** 2)
            share = grips[k] / max(sliding, CREEP_SPEED_M_S)
            result[k, 1], result[k, 2] = -share * speeds[k, 1], -share * speeds[k, 2]
    return result


@kernel
def _add_outer(matrix: Array, factor: float, row: Array) -> None:
    for i in range(len(row)):
        for j in range(len(row)):
            matrix[i, j] += factor * row[i] * row[j]


@kernel
def _curvature(rows: Array, speeds: Array, limits: Array, grips: Array, inertia: Array) -> Array:
    """Return the second derivatives of the function by the joint velocities."""
    result, across = inertia.copy(), np.zeros(len(inertia))
    for k in range(len(limits)):
        if -CREEP_SPEED_M_S < speeds[k, 0] < 0.0:
            _add_outer(result, limits[k] / CREEP_SPEED_M_S, rows[k, 0])
        if grips[k] > 0.0:
            first, second = speeds[k, 1], speeds[k, 2]
            sliding = np.sqrt(first**2 + second**2)
            if sliding > CREEP_SPEED_M_S:  # at its limit, friction is stiff across the sliding only
                for j in range(len(across)):
                    across[j] = (first * rows[k, 2, j] - second * rows[k, 1, j]) / sliding
                _add_outer(result, grips[k] / sliding, across)
            else:
                _add_outer(result, grips[k] / CREEP_SPEED_M_S, rows[k, 1])
                _add_outer(result, grips[k] / CREEP_SPEED_M_S, rows[k, 2])
    return result


@kernel
def _rise(speeds: Array, changes: Array, share: float, limits: Array, grips: Array) -> float:
    """Return the slope along a step, at a share of it, of the part of the function that the patches make."""
    total = 0.0
    for k in range(len(limits)):
        approach = -speeds[k, 0] - share * changes[k, 0]
        if approach > 0.0:
            total -= limits[k] * min(1.0, approach / CREEP_SPEED_M_S) * changes[k, 0]
        if grips[k] > 0.0:
            first, second = speeds[k, 1] + share * changes[k, 1], speeds[k, 2] + share * changes[k, 2]
            sliding = max(np.sqrt(first**2 + second**2), CREEP_SPEED_M_S)
            total += grips[k] * (first * changes[k, 1] + second * changes[k, 2]) / sliding
    return total


@kernel
def _lowest_share(speeds: Array, changes: Array, limits: Array, grips: Array, slope: float, curvature: float) -> float:
    """Return the share in (0, 1] of a step at which the function is lowest along it.

    `changes` are those of the speeds by the whole step; slope and curvature are those of the inertial part along it.
    """
    flat = _FLATNESS * abs(slope + _rise(speeds, changes, 0.0, limits, grips))
    if slope + curvature + _rise(speeds, changes, 1.0, limits, grips) <= flat:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        share = 0.5 * (low + high)
        rise = slope + share * curvature + _rise(speeds, changes, share, limits, grips)
        if abs(rise) <= flat:
            break
        if rise < 0.0:
            low = share
        else:
            high = share
    return share


@kernel
def _joint_impulse(rows: Array, impulses: Array) -> Array:
    """Add up impulses along the axes of the patches as one on the joints."""
    count, _, joints = rows.shape
    total = np.zeros(joints)
    for k in range(count):
        for a in range(3):
            for j in range(joints):
                total[j] += rows[k, a, j] * impulses[k, a]
    return total


@kernel
def _passive_share(inertia: Array, free_velocity: Array, total: Array) -> float:
    """Return the share of an impulse p at which its work s p (v0 + s M^-1 p) is not positive; 1 if solved well."""
    change = solved(inertia, total)
    free_work, own_work = 0.0, 0.0
    for j in range(len(total)):
        free_work += total[j] * free_velocity[j]
        own_work += total[j] * change[j]
    if free_work + own_work <= 0.0:
        return 1.0
    return max(0.0, -free_work / own_work)


@kernel
def _braked_velocity(
    rows: Array, limits: Array, grips: Array, inertia: Array, free_velocity: Array, guess: Array
) -> Array:
    """Return the joint velocities that minimise the function at the head of this module."""
    velocity = guess.copy()
    for _ in range(_STEPS):
        speeds = patch_speeds(rows, velocity)
        gained, downhill = np.zeros(len(velocity)), np.zeros(len(velocity))
        pushed = _joint_impulse(rows, patch_impulses(speeds, limits, grips))
        for i in range(len(velocity)):
            for j in range(len(velocity)):
                gained[i] += inertia[i, j] * (velocity[j] - free_velocity[j])
            downhill[i] = -(gained[i] - pushed[i])
        step = solved(_curvature(rows, speeds, limits, grips, inertia), downhill)
        slope, curvature, has_settled = 0.0, 0.0, True
        for i in range(len(velocity)):
            slope += gained[i] * step[i]
            has_settled = has_settled and abs(step[i]) < _TOLERANCE
        if has_settled:
            break
        for i in range(len(velocity)):
            for j in range(len(velocity)):
                curvature += step[i] * inertia[i, j] * step[j]
        changes = patch_speeds(rows, step)
        share = _lowest_share(speeds, changes, limits, grips, slope, curvature)
        for i in range(len(velocity)):
            velocity[i] += step[i] * share
    return velocity


@kernel
def braking_impulse(
    rows: Array, limits: Array, frictions: Array, inertia: Array, free_velocity: Array
) -> tuple[Array, Array]:
    """Return the impulse of the soil on the joints (n,) [N m s] and on each patch along its axes (k, 3) [N s].

    Args:
        rows: (k, 3, n) as from `patch_rows`.
        limits: (k,) greatest impulse along the normal [N s].
        frictions: (k,) friction coefficients.
        inertia: (n, n) effective inertia of the joints over the substep [kg m2].
        free_velocity: (n,) joint velocities at the end of the substep without soil [rad/s].
    """
    smooth, grips, rubs = np.zeros(len(limits)), np.zeros(len(limits)), False
    velocity = _braked_velocity(rows, limits, smooth, inertia, free_velocity, free_velocity)
    impulses = patch_impulses(patch_speeds(rows, velocity), limits, smooth)
    for k in range(len(limits)):
        grips[k] = frictions[k] * impulses[k, 0]
        rubs = rubs or grips[k] > 0.0
    if rubs:
        velocity = _braked_velocity(rows, limits, grips, inertia, free_velocity, velocity)
    impulses = patch_impulses(patch_speeds(rows, velocity), limits, grips)
    total = _joint_impulse(rows, impulses)
    share = _passive_share(inertia, free_velocity, total)
    for j in range(len(total)):
        total[j] = share * total[j]
    for k in range(len(limits)):
        for a in range(3):
            impulses[k, a] = share * impulses[k, a]
    return total, impulses
