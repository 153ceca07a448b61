"""Dig regions: where on a pile a scoop can be commanded, and the image mask that commands it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.tasks.scoop.feasibility import PATCH_SIZE_M, feasible_centers_w
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE
from lerobot_excav.errors import ExcavError

LEAST_DISTANCE_M = 1.0
"""Between the centres of two targets of a scene, on the ground plane [m] (kind: tuned)."""

_ORDERS = 100


class TooFewTargetsError(ExcavError):
    """A pile has no room for the wanted number of dig regions."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A square patch of the ground plane, turned towards the machine."""

    center_w: NDArray[np.float64]  # centre on the soil surface [m], shape (3,), world frame
    yaw_rad: float  # direction from the machine to the patch [rad]
    size_m: float = PATCH_SIZE_M  # edge length [m]

    @property
    def corners_w(self) -> NDArray[np.float64]:
        """Corners of the patch (4, 2) [m], counter-clockwise from above, world frame."""
        along = 0.5 * self.size_m * np.array([np.cos(self.yaw_rad), np.sin(self.yaw_rad)])
        across = np.array([-along[1], along[0]])
        offsets = np.array([-along - across, along - across, along + across, across - along])
        return np.asarray(self.center_w[:2] + offsets)

    def grown(self, margin_m: float) -> "Target":
        """Return the patch with a margin around it [m]."""
        return replace(self, size_m=self.size_m + 2.0 * margin_m)

    def contains(self, points_w: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points (..., 2) or (..., 3) [m], world frame, lie above, on or below the patch; NaN is outside."""
        offset = points_w[..., :2] - self.center_w[:2]
        cos, sin = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        along = offset[..., 0] * cos + offset[..., 1] * sin
        across = -offset[..., 0] * sin + offset[..., 1] * cos
        return np.asarray(np.maximum(np.abs(along), np.abs(across)) <= 0.5 * self.size_m)


def find_targets(
    heights_m: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64], rng: np.random.Generator
) -> tuple[Target, ...]:
    """Pick dig regions that are reachable and in view, hold enough soil and lie apart from each other.

    The soil is that of `feasible_centers_w`. The order of the targets tells nothing of their places.

    Raises:
        TooFewTargetsError: The pile offers fewer than `TARGETS_PER_SCENE` such regions.
    """
    centers_w = feasible_centers_w(heights_m, x_w, y_w)
    apart = np.linalg.norm(centers_w[:, None, :2] - centers_w[None, :, :2], axis=-1) >= LEAST_DISTANCE_M
    # Greedy picks can block each other: several random orders, then give up.
    for _ in range(_ORDERS):
        free = np.ones(len(centers_w), dtype=bool)
        picked: list[int] = []
        while len(picked) < TARGETS_PER_SCENE and free.any():
            picked.append(int(rng.choice(np.flatnonzero(free))))
            free &= apart[picked[-1]]
        if len(picked) == TARGETS_PER_SCENE:
            chosen_w = centers_w[picked]
            return tuple(Target(center_w=w.copy(), yaw_rad=cylinder_from_world(w)[1]) for w in chosen_w)
    raise TooFewTargetsError(f"the pile has no room for {TARGETS_PER_SCENE} dig regions; draw another pile")
