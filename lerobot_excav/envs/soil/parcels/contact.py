"""The contact law of parcels: normal spring and dashpot, sliding and rolling springs with memory.

Sliding and rolling follow Luding 2008 (Granular Matter 10:235, sections 2.3 and 2.4): a spring that remembers how far
the contact has slid (rolled) while it sticks, cut off at the friction coefficient times the normal force. Sand does not
bounce: the normal force fades as the partners separate, so that even a sudden overlap (a parcel born too near to
another one, ground that rose under it) pushes them apart at no more than `SEPARATION_M_S`, or the speed that its force
makes in one sub-step, before it can fade.
"""

import math
from typing import NamedTuple

from lerobot_excav.envs.soil.arrays import Array, Vector
from lerobot_excav.envs.soil.compiled import kernel

SPRINGS = 6
"""Memory of one contact: three components of the sliding spring and three of the rolling spring [m]."""

SEPARATION_M_S = 0.3
"""Largest speed at which a contact pushes its partners apart (guess: sand has next to no restitution)."""

LARGEST_OVERLAP = 0.5
"""Share of the radius above which the normal force grows no more (guess)."""

TANGENTIAL_STIFFNESS = 0.4
"""Stiffness of the sliding and the rolling spring over that of the normal spring (usual choice, e.g. 2/7 to 1)."""

NORMAL_DAMPING = 0.5
"""Damping ratio of the normal contact (guess: restitution of about 0.15)."""

TANGENTIAL_DAMPING = 0.2
"""Damping ratio of sliding and rolling springs (tuned: stable with a dozen contacts)."""

LARGEST_PHASE = 0.4
"""Largest phase of the normal spring per sub-step [rad]: what is too light for its stiffness has a softer contact."""

_TANGENTIAL_IMPEDANCE = math.sqrt(TANGENTIAL_STIFFNESS)


class Law(NamedTuple):
    """Coefficients of one kind of contact."""

    stiffness: float  # of the normal spring [N/m]
    sliding: float  # coefficient of sliding friction
    rolling: float  # coefficient of rolling friction, at the radius of the parcel


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def normal_force(overlap: float, separation_speed: float, stiffness: float, impedance: float, radius: float) -> float:
    """Return the normal force [N] of a contact; it never pulls.

    The impedance is the root of stiffness times effective mass [kg/s], the radius [m] that of the smaller partner.
    """
    force = stiffness * min(overlap, LARGEST_OVERLAP * radius) - 2.0 * NORMAL_DAMPING * impedance * separation_speed
    if separation_speed > 0.0:
        force *= max(0.0, 1.0 - separation_speed / SEPARATION_M_S)
    return max(0.0, force)


@kernel
def spring_force(
    springs: Array,
    row: int,
    first: int,
    normal: Vector,
    velocity: Vector,
    stiffness: float,
    damping: float,
    limit: float,
    dt: float,
) -> Vector:
    """Stretch one spring of a contact and return its force [N], at most `limit` in size.

    The spring is one of (n, 6) memories [m], which change in place: that of a contact `row`, `first` 0 for sliding or 3
    for rolling. The velocity [m/s] stretches it, but for its normal part; stiffness is in N/m and damping in kg/s.
    """
    along = dot(velocity, normal)
    v0, v1, v2 = (velocity[0] - along * normal[0], velocity[1] - along * normal[1], velocity[2] - along * normal[2])
    s0, s1, s2 = springs[row, first], springs[row, first + 1], springs[row, first + 2]
    along = s0 * normal[0] + s1 * normal[1] + s2 * normal[2]
    s0 += v0 * dt - along * normal[0]
    s1 += v1 * dt - along * normal[1]
    s2 += v2 * dt - along * normal[2]
    f0, f1, f2 = (-stiffness * s0 - damping * v0, -stiffness * s1 - damping * v1, -stiffness * s2 - damping * v2)
    square = f0 * f0 + f1 * f1 + f2 * f2
    if square > limit * limit:  # it slides: the spring keeps the stretch that friction can hold
        share = limit / math.sqrt(square)
        f0, f1, f2 = share * f0, share * f1, share * f2
        s0, s1, s2 = -f0 / stiffness, -f1 / stiffness, -f2 / stiffness
    springs[row, first], springs[row, first + 1], springs[row, first + 2] = s0, s1, s2
    return f0, f1, f2


@kernel
def forget(springs: Array, row: int) -> None:
    """Clear the memory of a contact that has opened."""
    for k in range(SPRINGS):
        springs[row, k] = 0.0


@kernel
def contact(
    springs: Array,
    row: int,
    normal: Vector,
    overlap: float,
    velocity: Vector,
    rolling_velocity: Vector,
    mass: float,
    radius: float,
    law: Law,
    dt: float,
) -> tuple[Vector, Vector]:
    """Return the force [N] on the first partner of a closed contact, and the force that its rolling makes.

    Args:
        springs: (n, 6) memories of contacts [m], changed in place.
        row: Which contact.
        normal: Unit normal towards the first partner.
        overlap: How deep the partners overlap [m], above 0.
        velocity: Velocity of the first partner relative to the second at the contact [m/s].
        rolling_velocity: Luding's rolling velocity, -r (n x relative spin) [m/s].
        mass: Effective mass of the pair [kg].
        radius: Radius of the smaller partner [m].
        law: Coefficients.
        dt: Duration [s].

    Returns:
        Force on the first partner; rolling force q, whose torque on the first partner is r n x q.
    """
    normal_stiffness = min(law.stiffness, mass * (LARGEST_PHASE / dt) ** 2)
    impedance = math.sqrt(normal_stiffness * mass)
    pressing = normal_force(overlap, dot(velocity, normal), normal_stiffness, impedance, radius)
    stiffness = TANGENTIAL_STIFFNESS * normal_stiffness
    damping = 2.0 * TANGENTIAL_DAMPING * _TANGENTIAL_IMPEDANCE * impedance
    slide = spring_force(springs, row, 0, normal, velocity, stiffness, damping, law.sliding * pressing, dt)
    roll = spring_force(springs, row, 3, normal, rolling_velocity, stiffness, damping, law.rolling * pressing, dt)
    push = (pressing * normal[0] + slide[0], pressing * normal[1] + slide[1], pressing * normal[2] + slide[2])
    return push, roll


@kernel
def wall_contact(
    springs: Array,
    row: int,
    normal: Vector,
    gap: float,
    velocity: Vector,
    spin: Vector,
    mass: float,
    radius: float,
    law: Law,
    dt: float,
) -> tuple[Vector, Vector]:
    """Return force [N] and torque [N m] on a parcel that touches something that it does not move.

    Its centre has a distance `gap` [m] below its radius, a velocity relative to the wall [m/s] and a spin [rad/s]; the
    other arguments are as in `contact`.
    """
    arm = (-gap * normal[0], -gap * normal[1], -gap * normal[2])
    turning = cross(spin, arm)
    sliding = (velocity[0] + turning[0], velocity[1] + turning[1], velocity[2] + turning[2])
    rolling = cross(normal, spin)
    rolling = (-radius * rolling[0], -radius * rolling[1], -radius * rolling[2])
    force, roll = contact(springs, row, normal, radius - gap, sliding, rolling, mass, radius, law, dt)
    torque, rolling_torque = cross(arm, force), cross(normal, roll)
    return force, (
        torque[0] + radius * rolling_torque[0],
        torque[1] + radius * rolling_torque[1],
        torque[2] + radius * rolling_torque[2],
    )
