"""Soil in the air: parcels that fall, meet the walls of the target box and land."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.height_field import Grid, in_grid, surface_height
from lerobot_excav.envs.soil.parameters import GRAVITY_M_S2

Array = NDArray[np.float64]
Box = tuple[float, float, float, float, float, float, float, float]
"""A container as kernels take it: centre x, y, floor z, half lengths, wall top z, cos and sin of its yaw."""

NO_BOX: Box = (0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 1.0, 0.0)

FLYING, ON_GRID, IN_BOX, OUT_OF_BOUNDS = range(4)

_WALL_GAP_M = 1e-6


@kernel
def to_box(box: Box, x: float, y: float) -> tuple[float, float]:
    """Turn a world point into the plane of the container."""
    a, b = x - box[0], y - box[1]
    return box[6] * a + box[7] * b, -box[7] * a + box[6] * b


@kernel
def in_box(box: Box, u: float, v: float) -> bool:
    """Tell whether a point of the container's plane lies over its floor."""
    return abs(u) < box[3] and abs(v) < box[4]


@kernel
def _wall_crossing(box: Box, u0: float, v0: float, u1: float, v1: float) -> float:
    """Return the share of a level path at which it passes the footprint's border; one end is inside."""
    share = 1.0 if in_box(box, u0, v0) else 0.0
    leaves = share == 1.0
    for axis in range(2):
        start, end, half = (u0, u1, box[3]) if axis == 0 else (v0, v1, box[4])
        step = end - start
        if step == 0.0:
            continue
        far = ((half if step > 0.0 else -half) - start) / step
        near = ((-half if step > 0.0 else half) - start) / step
        share = min(share, far) if leaves else max(share, near)
    return min(max(share, 0.0), 1.0)


@kernel
def _stop_at_wall(box: Box, position: Array, velocity: Array, before: tuple[float, float, float]) -> None:
    """Let a parcel that would pass through a wall fall along it instead: a perfectly plastic impact."""
    u0, v0 = to_box(box, before[0], before[1])
    u1, v1 = to_box(box, position[0], position[1])
    inside = in_box(box, u0, v0)
    if inside == in_box(box, u1, v1):
        return
    share = _wall_crossing(box, u0, v0, u1, v1)
    if before[2] + share * (position[2] - before[2]) >= box[5]:
        return
    u, v = u0 + share * (u1 - u0), v0 + share * (v1 - v0)
    sign = -1.0 if inside else 1.0
    if box[3] - abs(u) < box[4] - abs(v):  # nearer to a wall across x
        u = math.copysign(box[3] + sign * _WALL_GAP_M, u)
    else:
        v = math.copysign(box[4] + sign * _WALL_GAP_M, v)
    position[0] = box[0] + box[6] * u - box[7] * v
    position[1] = box[1] + box[7] * u + box[6] * v
    velocity[0] = 0.0
    velocity[1] = 0.0


@kernel
def fly(
    positions: Array,
    velocities: Array,
    dt: float,
    radius: float,
    ground: tuple[Array, Grid, float],
    inside: tuple[Array, Grid],
    box: Box,
) -> NDArray[np.int64]:
    """Advance parcels by one step of free fall.

    Args:
        positions: (n, 3) centres [m], changed in place.
        velocities: (n, 3) [m/s], changed in place.
        dt: Duration [s].
        radius: Radius of a parcel [m].
        ground: Heights of the dig area, their grid, and the world z of the rigid floor.
        inside: Heights in the container and their grid.
        box: The container.

    Returns:
        (n,) where each parcel is now: `FLYING`, `ON_GRID`, `IN_BOX` or `OUT_OF_BOUNDS`. Outside of both fields
        the ground is level at z = 0.
    """
    place = np.zeros(len(positions), dtype=np.int64)
    for k in range(len(positions)):
        p = positions[k]
        before = (p[0], p[1], p[2])
        p[0] += velocities[k, 0] * dt
        p[1] += velocities[k, 1] * dt
        p[2] += velocities[k, 2] * dt - 0.5 * GRAVITY_M_S2 * dt * dt
        velocities[k, 2] -= GRAVITY_M_S2 * dt
        _stop_at_wall(box, p, velocities[k], before)
        u, v = to_box(box, p[0], p[1])
        if in_box(box, u, v):
            surface, landing = box[2] + surface_height(inside[0], inside[1], u, v), IN_BOX
        elif in_grid(ground[0], ground[1], p[0], p[1]):
            surface, landing = ground[2] + surface_height(ground[0], ground[1], p[0], p[1]), ON_GRID
        else:
            surface, landing = 0.0, OUT_OF_BOUNDS
        if p[2] - radius <= surface:
            place[k] = landing
    return place


@dataclass(frozen=True, kw_only=True, eq=False)
class Landed:
    """Parcels that reached a surface in one step: (n, 2) points in the world plane and (n,) masses [kg]."""

    points_w: Array
    masses_kg: Array


class Parcels:
    """Parcels in the air.

    Attributes:
        positions_w: (n, 3) centres [m].
        velocities_w: (n, 3) [m/s].
        masses_kg: (n,) masses; the last parcel of a spill may be lighter, and parcels above the limit heavier.
    """

    def __init__(self) -> None:
        """Start with none."""
        self.clear()

    def clear(self) -> None:
        """Remove all parcels."""
        self.positions_w: Array = np.zeros((0, 3))
        self.velocities_w: Array = np.zeros((0, 3))
        self.masses_kg: Array = np.zeros(0)

    def __len__(self) -> int:
        return len(self.masses_kg)

    @property
    def mass_kg(self) -> float:
        """Mass of all parcels [kg]."""
        return float(self.masses_kg.sum())

    def add(self, positions_w: Array, velocities_w: Array, masses_kg: Array) -> None:
        """Add parcels at (n, 3) positions."""
        self.positions_w = np.concatenate([self.positions_w, positions_w])
        self.velocities_w = np.concatenate([self.velocities_w, velocities_w])
        self.masses_kg = np.concatenate([self.masses_kg, masses_kg])

    def step(
        self,
        dt_s: float,
        radius_m: float,
        ground: tuple[Array, Grid, float],
        inside: tuple[Array, Grid],
        box: Box,
    ) -> dict[int, Landed]:
        """Advance by free fall and remove the parcels that landed; return them by place."""
        if len(self) == 0:
            return {}
        place = fly(self.positions_w, self.velocities_w, dt_s, radius_m, ground, inside, box)
        landed = {
            where: Landed(
                points_w=self.positions_w[place == where, :2], masses_kg=self.masses_kg[place == where]
            )
            for where in (ON_GRID, IN_BOX, OUT_OF_BOUNDS)
            if (place == where).any()
        }
        flying = place == FLYING
        if landed:
            self.positions_w = self.positions_w[flying]
            self.velocities_w = self.velocities_w[flying]
            self.masses_kg = self.masses_kg[flying]
        return landed
