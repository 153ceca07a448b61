"""Twin of `parcels.contact`: Luding's contact law in vectors."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.parcels.contact import (
    LARGEST_OVERLAP,
    LARGEST_PHASE,
    NORMAL_DAMPING,
    SEPARATION_M_S,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
    Law,
)


def normal_force(overlap: float, separation_speed: float, stiffness: float, mass: float, radius: float) -> float:
    """Return spring plus dashpot [N], faded out at the separation speed and never pulling."""
    spring = stiffness * min(overlap, LARGEST_OVERLAP * radius)
    dashpot = 2.0 * NORMAL_DAMPING * math.sqrt(stiffness * mass) * separation_speed
    fade = float(np.clip(1.0 - separation_speed / SEPARATION_M_S, 0.0, 1.0))
    return max(0.0, fade * (spring - dashpot))


def stretch(
    spring: Array, normal: Array, velocity: Array, stiffness: float, damping: float, limit: float, dt: float
) -> tuple[Array, Array]:
    """Return the force [N] of a sliding or rolling spring and its new stretch [m]."""
    tangent = np.eye(3) - np.outer(normal, normal)
    spring = tangent @ spring + tangent @ velocity * dt
    force = -stiffness * spring - damping * (tangent @ velocity)
    size = float(np.linalg.norm(force))
    if size <= limit:
        return force, spring
    force = force * (limit / size)
    return force, -force / stiffness


def contact(
    springs: Array,
    normal: Array,
    overlap: float,
    velocity: Array,
    rolling_velocity: Array,
    mass: float,
    radius: float,
    law: Law,
    dt: float,
) -> tuple[Array, Array]:
    """Return the force on the first partner and the rolling force [N]; (6,) springs are changed in place."""
    normal_stiffness = min(law.stiffness, mass * (LARGEST_PHASE / dt) ** 2)
    pressing = normal_force(overlap, float(velocity @ normal), normal_stiffness, mass, radius)
    stiffness = TANGENTIAL_STIFFNESS * normal_stiffness
    damping = 2.0 * TANGENTIAL_DAMPING * math.sqrt(stiffness * mass)
    slide, springs[:3] = stretch(springs[:3], normal, velocity, stiffness, damping, law.sliding * pressing, dt)
    roll, springs[3:] = stretch(springs[3:], normal, rolling_velocity, stiffness, damping, law.rolling * pressing, dt)
    return pressing * normal + slide, roll


def wall_contact(
    springs: Array,
    normal: Array,
    gap: float,
    velocity: Array,
    spin: Array,
    mass: float,
    radius: float,
    law: Law,
    dt: float,
) -> tuple[Array, Array]:
    """Return force [N] and torque [N m] on a parcel at a wall that moves away from it at minus `velocity`."""
    arm = -gap * normal
    rolling_velocity = np.asarray(-radius * np.cross(normal, spin), dtype=np.float64)
    force, roll = contact(
        springs, normal, radius - gap, velocity + np.cross(spin, arm), rolling_velocity, mass, radius, law, dt
    )
    return force, np.cross(arm, force) + radius * np.cross(normal, roll)
