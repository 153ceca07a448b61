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

_STEPS = 30
"""Bound on Newton's steps; a dig takes some five."""

_TOLERANCE = 1e-10
"""Step at which the joint velocities have settled [rad/s]."""

_HALVINGS = 30
_ARMIJO = 1e-4
"""Share of the predicted descent that a step must reach, and how often it is halved for that."""


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
    """Return how the joints move the points of the patches along their axes.

    Args:
        jacobian: (6, n) of the tool origin: linear, then angular velocity in the world.
        rotation: (3, 3) of the tool.
        points_t: (k, 3) in the tool frame [m].
        axes_t: (k, 3, 3) normal and two tangents of each patch as rows, in the tool frame.

    Returns:
        (k, 3, n) rows: speed along an axis per joint rate.
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
                velocity[a] = (
                    motion[a, j] + motion[3 + b, j] * points_t[k, c] - motion[3 + c, j] * points_t[k, b]
                )
            for row in range(3):
                for a in range(3):
                    rows[k, row, j] += axes_t[k, row, a] * velocity[a]
    return rows


@kernel
def _speed(rows: Array, k: int, axis: int, velocity: Array) -> float:
    total = 0.0
    for j in range(len(velocity)):
        total += rows[k, axis, j] * velocity[j]
    return total


@kernel
def _rounded(speed: float) -> float:
    """Return h of the head of this module."""
    if speed <= 0.0:
        return 0.0
    if speed < CREEP_SPEED_M_S:
        return 0.5 * speed * speed / CREEP_SPEED_M_S
    return speed - 0.5 * CREEP_SPEED_M_S


@kernel
def patch_impulses(rows: Array, limits: Array, grips: Array, velocity: Array) -> Array:
    """Return the impulse of each patch along its axes at some joint velocities, (k, 3) [N s]."""
    result = np.zeros((len(limits), 3))
    for k in range(len(limits)):
        approach = -_speed(rows, k, 0, velocity)
        if approach > 0.0:
            result[k, 0] = limits[k] * min(1.0, approach / CREEP_SPEED_M_S)
        if grips[k] > 0.0:
            first, second = _speed(rows, k, 1, velocity), _speed(rows, k, 2, velocity)
            share = grips[k] / max(np.sqrt(first**2 + second**2), CREEP_SPEED_M_S)
            result[k, 1], result[k, 2] = -share * first, -share * second
    return result


@kernel
def _objective(
    rows: Array, limits: Array, grips: Array, inertia: Array, free_velocity: Array, velocity: Array
) -> float:
    """Return what the joint velocities minimise."""
    total = 0.0
    for i in range(len(velocity)):
        for j in range(len(velocity)):
            total += 0.5 * (velocity[i] - free_velocity[i]) * inertia[i, j] * (velocity[j] - free_velocity[j])
    for k in range(len(limits)):
        total += limits[k] * _rounded(-_speed(rows, k, 0, velocity))
        if grips[k] > 0.0:
            first, second = _speed(rows, k, 1, velocity), _speed(rows, k, 2, velocity)
            total += grips[k] * _rounded(np.sqrt(first**2 + second**2))
    return total


@kernel
def _curvature(rows: Array, limits: Array, grips: Array, inertia: Array, velocity: Array) -> Array:
    """Return the second derivatives of `_objective` by the joint velocities."""
    joints = len(velocity)
    result = inertia.copy()
    for k in range(len(limits)):
        approach = -_speed(rows, k, 0, velocity)
        if 0.0 < approach < CREEP_SPEED_M_S:
            for i in range(joints):
                for j in range(joints):
                    result[i, j] += limits[k] / CREEP_SPEED_M_S * rows[k, 0, i] * rows[k, 0, j]
        if grips[k] > 0.0:
            first, second = _speed(rows, k, 1, velocity), _speed(rows, k, 2, velocity)
            sliding = np.sqrt(first**2 + second**2)
            stiffness = grips[k] / max(sliding, CREEP_SPEED_M_S)
            for i in range(joints):
                for j in range(joints):
                    result[i, j] += stiffness * (
                        rows[k, 1, i] * rows[k, 1, j] + rows[k, 2, i] * rows[k, 2, j]
                    )
            if sliding > CREEP_SPEED_M_S:  # along the sliding, friction is at its limit and no stiffer
                for i in range(joints):
                    along_i = (rows[k, 1, i] * first + rows[k, 2, i] * second) / sliding
                    for j in range(joints):
                        along_j = (rows[k, 1, j] * first + rows[k, 2, j] * second) / sliding
                        result[i, j] -= stiffness * along_i * along_j
    return result


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
    """Return the joint velocities that minimise `_objective`, by Newton's method with bisected steps."""
    velocity = guess.copy()
    for _ in range(_STEPS):
        slope = -_joint_impulse(rows, patch_impulses(rows, limits, grips, velocity))
        for i in range(len(velocity)):
            for j in range(len(velocity)):
                slope[i] += inertia[i, j] * (velocity[j] - free_velocity[j])
        step = solved(_curvature(rows, limits, grips, inertia, velocity), -slope)
        if np.max(np.abs(step)) < _TOLERANCE:
            break
        start = _objective(rows, limits, grips, inertia, free_velocity, velocity)
        descent = _ARMIJO * np.sum(slope * step)
        share = 1.0
        for _ in range(_HALVINGS):
            ahead = velocity + share * step
            if _objective(rows, limits, grips, inertia, free_velocity, ahead) <= start + share * descent:
                break
            share *= 0.5
        velocity += share * step
    return velocity


@kernel
def braking_impulse(
    rows: Array, limits: Array, frictions: Array, inertia: Array, free_velocity: Array
) -> tuple[Array, Array]:
    """Return what the soil takes from the joints in one substep.

    Args:
        rows: (k, 3, n) as from `patch_rows`.
        limits: (k,) greatest impulse along the normal [N s].
        frictions: (k,) friction coefficients.
        inertia: (n, n) effective inertia of the joints over the substep [kg m2].
        free_velocity: (n,) joint velocities at the end of the substep without soil [rad/s].

    Returns:
        Impulse on the joints, (n,) [N m s], and on each patch along its axes, (k, 3) [N s].
    """
    smooth = np.zeros(len(limits))
    velocity = _braked_velocity(rows, limits, smooth, inertia, free_velocity, free_velocity)
    grips = frictions * patch_impulses(rows, limits, smooth, velocity)[:, 0]
    if np.any(grips > 0.0):
        velocity = _braked_velocity(rows, limits, grips, inertia, free_velocity, velocity)
    impulses = patch_impulses(rows, limits, grips, velocity)
    total = _joint_impulse(rows, impulses)
    share = _passive_share(inertia, free_velocity, total)
    return share * total, share * impulses
