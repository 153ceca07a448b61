"""What soil can hold against a tool: small patches, each a one-sided brake with a limit.

A patch pushes along its normal with any force from zero to its limit, as much as it takes to stop the tool's
approach, and rubs across the normal with at most the friction coefficient times that push. So the soil's answer to
a motion is the admissible force that takes the most power from it (rate-independent plasticity): it has no
preferred direction of its own to jump to, can hold a tool at rest and never drives one.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel

FULL_SHARE = 0.2
"""Share of the speed into a patch, or across it, from which on `Patches.wrench` gives the full force (guess)."""

REST_SPEED_M_S = 0.01
"""Speed below which `Patches.wrench` fades out (guess): far below any digging speed, above the creep at a stall."""


class PatchKind(IntEnum):
    """Where the limit of a patch comes from."""

    WEDGE = 0
    """Soil ahead of the plate that must fail along a plane before the plate can move into it."""

    PENETRATION = 1
    """Soil that stands against the blunt front of the cutting edge."""

    PRESSURE = 2
    """Soil that stands against the outer face of a plate."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Patches:
    """Resistance that the soil can offer to a tool."""

    points_w: Array  # (k, 3) points of the tool [m]
    normals_w: Array  # (k, 3) unit directions in which the soil pushes the tool
    limits_n: Array  # (k,) greatest push [N], above zero
    frictions: Array  # (k,) friction coefficient across the normal
    kinds: NDArray[np.int8]  # (k,) `PatchKind`

    @classmethod
    def none(cls) -> "Patches":
        """Return no resistance at all."""
        return _NONE

    @classmethod
    def alike(cls, points_w: Array, normals_w: Array, limits_n: Array, friction: float, kind: PatchKind) -> "Patches":
        """Return patches of one kind and one friction coefficient; those without a limit above zero are left out."""
        holds = limits_n > 0.0
        count = np.count_nonzero(holds)
        if count == 0:
            return _NONE
        return cls(
            points_w=points_w[holds],
            normals_w=normals_w[holds],
            limits_n=limits_n[holds],
            frictions=np.full(count, friction),
            kinds=np.full(count, kind, dtype=np.int8),
        )

    @classmethod
    def joined(cls, *parts: "Patches") -> "Patches":
        """Return the patches of all parts."""
        holding = [part for part in parts if len(part.limits_n)]
        if len(holding) < 2:
            return holding[0] if holding else _NONE
        return cls(
            points_w=np.concatenate([part.points_w for part in holding]),
            normals_w=np.concatenate([part.normals_w for part in holding]),
            limits_n=np.concatenate([part.limits_n for part in holding]),
            frictions=np.concatenate([part.frictions for part in holding]),
            kinds=np.concatenate([part.kinds for part in holding]),
        )

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.limits_n)

    @property
    def full_forces_w_n(self) -> Array:
        """(k, 3) pushes at their limits [N], without friction."""
        return np.asarray(self.limits_n[:, None] * self.normals_w)

    def of_kind(self, kind: PatchKind) -> "Patches":
        """Return the patches of one kind."""
        chosen = self.kinds == kind
        return Patches(**{name: array[chosen] for name, array in vars(self).items()})

    def bounded(self, total_n: float, *kinds: PatchKind) -> "Patches":
        """Return the same patches, with the limits of some kinds scaled down to add up to a total [N] at most."""
        chosen = np.zeros(len(self.kinds), dtype=np.bool_)
        for kind in kinds:
            chosen |= self.kinds == kind
        sum_n = float(self.limits_n[chosen].sum())
        if sum_n <= total_n:
            return self
        return Patches(
            points_w=self.points_w,
            normals_w=self.normals_w,
            limits_n=np.where(chosen, total_n / sum_n * self.limits_n, self.limits_n),
            frictions=self.frictions,
            kinds=self.kinds,
        )

    def wrench(self, origin_w: Array, linear_velocity_w: Array, angular_velocity_w: Array) -> tuple[Array, Array]:
        """Return force [N] and torque about the origin [N m] on a tool that moves on unhindered, both (3,).

        Every push and every friction force is full from a share `FULL_SHARE` of the speed on, and in between
        proportional to it, so the wrench is continuous in the motion. Its power is never positive.
        """
        motion = np.array(origin_w), np.array(linear_velocity_w), np.array(angular_velocity_w)
        return patch_wrench(self.points_w, self.normals_w, self.limits_n, self.frictions, *motion)


_NONE = Patches(
    points_w=np.zeros((0, 3)),
    normals_w=np.zeros((0, 3)),
    limits_n=np.zeros(0),
    frictions=np.zeros(0),
    kinds=np.zeros(0, dtype=np.int8),
)


@kernel
def patch_wrench(
    points: Array, normals: Array, limits: Array, frictions: Array, origin: Array, linear: Array, angular: Array
) -> tuple[Array, Array]:
    """Add up the forces of patches on a moving tool; arguments and result as in `Patches.wrench`."""
    force, torque = np.zeros(3), np.zeros(3)
    for k in range(len(limits)):
        n0, n1, n2 = normals[k, 0], normals[k, 1], normals[k, 2]
        a0, a1, a2 = points[k, 0] - origin[0], points[k, 1] - origin[1], points[k, 2] - origin[2]
        v0 = linear[0] + (angular[1] * a2 - angular[2] * a1)
        v1 = linear[1] + (angular[2] * a0 - angular[0] * a2)
        v2 = linear[2] + (angular[0] * a1 - angular[1] * a0)
        speed = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2 + REST_SPEED_M_S**2)
        approach = -(v0 * n0 + v1 * n1 + v2 * n2)
        if approach <= 0.0:
            continue
        push = limits[k] * min(1.0, approach / (FULL_SHARE * speed))
        c0, c1, c2 = v0 + approach * n0, v1 + approach * n1, v2 + approach * n2  # across the normal
        most = max(math.sqrt(c0 * c0 + c1 * c1 + c2 * c2), FULL_SHARE * speed)
        f0 = push * (n0 - frictions[k] * c0 / most)
        f1 = push * (n1 - frictions[k] * c1 / most)
        f2 = push * (n2 - frictions[k] * c2 / most)
        force[0] += f0
        force[1] += f1
        force[2] += f2
        torque[0] += a1 * f2 - a2 * f1
        torque[1] += a2 * f0 - a0 * f2
        torque[2] += a0 * f1 - a1 * f0
    return force, torque
