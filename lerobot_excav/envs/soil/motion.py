"""Poses of the tool and the steps between them."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.tool import Tool


class Pose(NamedTuple):
    """Position (3,) [m] with z above the rigid floor, and rotation (3, 3), as writable arrays for kernels."""

    position: Array
    rotation: Array

    @classmethod
    def of(cls, tool: Tool, floor_depth_m: float) -> "Pose":
        """Copy the pose of a tool."""
        return cls(position=tool.position_w + np.array([0.0, 0.0, floor_depth_m]), rotation=np.array(tool.rotation_w))

    def place(self, points_t: Array) -> Array:
        """Turn (n, 3) tool points into world points [m]."""
        return self.position + points_t @ self.rotation.T


@kernel
def _largest_motion(points: Array, before: Pose, now: Pose) -> float:
    largest = 0.0
    for k in range(len(points)):
        square = 0.0
        for a in range(3):
            moved = now.position[a] - before.position[a]
            for b in range(3):
                moved += (now.rotation[a, b] - before.rotation[a, b]) * points[k, b]
            square += moved * moved
        largest = max(largest, square)
    return math.sqrt(largest)


def largest_motion(points_t: Array, before: Pose, now: Pose) -> float:
    """Return the farthest that any of (n, 3) tool points moved [m]."""
    return _largest_motion(points_t, before, now)


@kernel
def turned(rotation: Array, turn: Array, share: float) -> Array:
    """Turn a rotation by a share of a rotation vector in its own frame (Rodrigues)."""
    whole = math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    angle = whole * share
    if angle < 1e-15:
        return rotation.copy()
    x, y, z = turn[0] / whole, turn[1] / whole, turn[2] / whole
    sin, versine = math.sin(angle), 1.0 - math.cos(angle)
    first = (1.0 - versine * (y * y + z * z), versine * x * y - sin * z, versine * x * z + sin * y)
    second = (versine * x * y + sin * z, 1.0 - versine * (x * x + z * z), versine * y * z - sin * x)
    third = (versine * x * z - sin * y, versine * y * z + sin * x, 1.0 - versine * (x * x + y * y))
    result = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            result[a, b] = rotation[a, 0] * first[b] + rotation[a, 1] * second[b] + rotation[a, 2] * third[b]
    return result


@kernel
def _interpolate(position: Array, travel: Array, rotation: Array, turn: Array, steps: int) -> tuple[Array, Array]:
    """Return positions (steps + 1, 3) and rotations (steps + 1, 3, 3) along a straight line with a constant turn."""
    positions, rotations = np.zeros((steps + 1, 3)), np.zeros((steps + 1, 3, 3))
    for k in range(steps + 1):
        rotated = turned(rotation, turn, k / steps)
        for a in range(3):
            positions[k, a] = position[a] + k / steps * travel[a]
            for b in range(3):
                rotations[k, a, b] = rotated[a, b]
    return positions, rotations


def path(before: Pose, now: Pose, steps: int) -> tuple[Array, Array, Array]:
    """Return the poses before each of some equal steps and after the last, and the whole turn.

    They are positions (steps + 1, 3) [m], rotations (steps + 1, 3, 3), and a rotation vector (3,) in the world [rad].
    """
    turn = _rotation_vector(before.rotation.T @ now.rotation)
    positions, rotations = _interpolate(before.position, now.position - before.position, before.rotation, turn, steps)
    return positions, rotations, before.rotation @ turn


def _rotation_vector(rotation: Array) -> Array:
    """Return axis times angle of a rotation by less than pi."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    skew = np.array([zy - yz, xz - zx, yx - xy])
    sine = 0.5 * math.sqrt(skew.dot(skew))
    angle = math.atan2(sine, 0.5 * (xx + yy + zz - 1.0))
    return skew * (0.5 * angle / sine) if sine > 1e-12 else 0.5 * skew


def poses_between(before: Pose, now: Pose, steps: int) -> Iterator[tuple[Pose, Pose]]:
    """Yield the start and end poses of equal steps along a screw-free path: straight line, constant turn."""
    if steps == 1:
        yield before, now
        return
    positions, rotations, _ = path(before, now, steps)
    inner = map(Pose, positions[1:-1], rotations[1:-1])
    yield from pairwise([before, *inner, now])
