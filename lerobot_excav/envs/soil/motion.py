"""Poses of the tool and the steps between them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.tool import Tool

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Pose:
    """Position (3,) [m] with z above the rigid floor, and rotation (3, 3), as writable arrays for kernels."""

    position: Array
    rotation: Array

    @classmethod
    def of(cls, tool: Tool, floor_depth_m: float) -> "Pose":
        """Copy the pose of a tool."""
        return cls(
            position=tool.position_w + np.array([0.0, 0.0, floor_depth_m]), rotation=np.array(tool.rotation_w)
        )

    @property
    def arrays(self) -> tuple[Array, Array]:
        """Return position and rotation in the form that kernels take."""
        return self.position, self.rotation

    def place(self, points_t: Array) -> Array:
        """Turn (n, 3) tool points into world points [m]."""
        return self.position + points_t @ self.rotation.T


def largest_motion(points_t: Array, before: Pose, now: Pose) -> float:
    """Return the farthest that any of (n, 3) tool points moved [m]."""
    moved = now.place(points_t) - before.place(points_t)
    return float(np.sqrt((moved * moved).sum(axis=1).max()))


def _turned(rotation: Array, turn: Array, share: float) -> Array:
    """Turn a rotation by a share of a rotation vector in its own frame (Rodrigues)."""
    angle = float(np.linalg.norm(turn)) * share
    if angle < 1e-15:
        return rotation
    x, y, z = turn / np.linalg.norm(turn)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    result: Array = rotation @ (np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
    return result


def _rotation_vector(rotation: Array) -> Array:
    """Return axis times angle of a rotation by less than pi."""
    skew = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = 0.5 * float(np.linalg.norm(skew))
    angle = math.atan2(sine, 0.5 * (float(np.trace(rotation)) - 1.0))
    return skew * (0.5 * angle / sine) if sine > 1e-12 else 0.5 * skew


def poses_between(before: Pose, now: Pose, steps: int) -> Iterator[tuple[Pose, Pose]]:
    """Yield the start and end poses of equal steps along a screw-free path: straight line, constant turn."""
    turn = _rotation_vector(before.rotation.T @ now.rotation) if steps > 1 else np.zeros(3)
    shares = [k / steps for k in range(1, steps)]
    inner = [
        Pose(
            position=before.position + share * (now.position - before.position),
            rotation=_turned(before.rotation, turn, share),
        )
        for share in shares
    ]
    yield from pairwise([before, *inner, now])
