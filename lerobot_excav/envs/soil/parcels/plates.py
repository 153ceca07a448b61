"""Contact of parcels with thin plates: the shell and the sides of the bucket, the walls of the target box."""

import math
from typing import NamedTuple

from lerobot_excav.envs.soil.arrays import Array, Vector
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.cutting import to_tool
from lerobot_excav.envs.soil.parcels.contact import SPRINGS, Law, cross, dot, forget, wall_contact
from lerobot_excav.envs.soil.parcels.impact import add_impulse
from lerobot_excav.envs.soil.parcels.store import OFF_BUCKET, OUTSIDE_OF_SHELL, SHELTERED, State

CLOSEST = 0.25
"""Share of its radius to which a parcel's centre may come near to a plate; there it is put back."""

LARGEST_APPROACH = 0.8
"""Share of its distance from a plate that a parcel may come nearer within a sub-step, so that none passes through."""

_HAIR_M = 1e-9


class BoxWalls(NamedTuple):
    """A target box; z counts from the rigid floor."""

    x: float  # centre of its floor along x [m]
    y: float  # the same along y [m]
    floor_z: float  # height of its floor [m]
    half_x: float  # half of its inner length along its own x [m]; below zero without a box
    half_y: float  # the same along its own y [m]
    top_z: float  # height of the top of its walls [m]
    cos: float  # cosine of its yaw
    sin: float  # sine of its yaw


NO_BOX = BoxWalls(0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 1.0, 0.0)


class ToolPath(NamedTuple):
    """The bucket during one step."""

    present: int  # 1 if there is one, else 0
    profile: Array  # (n, 2) points from edge to lip, tool frame [m]
    planes: Array  # (n + 2, 4) half-spaces of its inside: opening, plates, right, left
    half_width: float  # of the inside [m]
    positions: Array  # (steps + 1, 3) origin before each sub-step and after the last [m], z above the rigid floor
    rotations: Array  # (steps + 1, 3, 3) the same
    linear: Array  # (3,) velocity of the origin [m/s]
    angular: Array  # (3,) angular velocity [rad/s]


@kernel
def turned(rotation: Array, v: Vector) -> Vector:
    """Turn a tool vector into the world."""
    return (
        rotation[0, 0] * v[0] + rotation[0, 1] * v[1] + rotation[0, 2] * v[2],
        rotation[1, 0] * v[0] + rotation[1, 1] * v[1] + rotation[1, 2] * v[2],
        rotation[2, 0] * v[0] + rotation[2, 1] * v[1] + rotation[2, 2] * v[2],
    )


@kernel
def inside_depth(planes: Array, first: int, q: Vector) -> float:
    """Return how deep a tool point lies inside of the half-spaces from the given one on [m]; negative outside."""
    depth = math.inf
    for k in range(first, len(planes)):
        depth = min(depth, planes[k, 3] - planes[k, 0] * q[0] - planes[k, 1] * q[1] - planes[k, 2] * q[2])
    return depth


@kernel
def _on_segment(profile: Array, k: int, x: float, z: float) -> tuple[float, float]:
    """Return the point of the k-th side of the closed profile that is nearest to a point."""
    m = (k + 1) % len(profile)
    ax, az = profile[k, 0], profile[k, 1]
    bx, bz = profile[m, 0] - ax, profile[m, 1] - az
    share = ((x - ax) * bx + (z - az) * bz) / (bx * bx + bz * bz)
    share = min(max(share, 0.0), 1.0)
    return ax + share * bx, az + share * bz


@kernel
def nearest_on_plate(profile: Array, planes: Array, half_width: float, plate: int, q: Vector) -> Vector:
    """Return the point of a plate nearest to a tool point.

    Plates 0 to n - 2 are the shell from the edge to the lip, n - 1 and n the right and the left side.
    """
    sides = len(profile) - 1
    if plate < sides:
        x, z = _on_segment(profile, plate, q[0], q[2])
        return x, min(max(q[1], -half_width), half_width), z
    y = -half_width if plate == sides else half_width
    x, z = q[0], q[2]
    best = 0.0
    for k in range(len(profile)):  # plane 0 is the opening: the last side of the closed profile
        plane = k + 1 if k < sides else 0
        if planes[plane, 0] * q[0] + planes[plane, 2] * q[2] > planes[plane, 3]:
            a, b = _on_segment(profile, k, q[0], q[2])
            far = (a - q[0]) ** 2 + (b - q[2]) ** 2
            if best == 0.0 or far < best:
                best, x, z = far, a, b
    return x, y, z


@kernel
def keep_out(
    positions: Array, velocities: Array, i: int, normal: Vector, gap: float, radius: float, velocity: Vector, dt: float
) -> Vector:
    """Put parcel i that came too near to a plate back, and take the speed with which it would pass through.

    Positions and velocities of all parcels are (n, 3) and change in place; the other arguments are as in
    `contact.wall_contact`. Returns the relative velocity that is left [m/s].
    """
    back = max(0.0, CLOSEST * radius - gap)
    excess = max(0.0, -dot(velocity, normal) - LARGEST_APPROACH * (gap + back) / dt)
    for a in range(3):
        positions[i, a] += back * normal[a]
        velocities[i, a] += excess * normal[a]
    return (velocity[0] + excess * normal[0], velocity[1] + excess * normal[1], velocity[2] + excess * normal[2])


@kernel
def bucket_reach(tool: ToolPath) -> float:
    """Return how far the bucket's corners are from its origin [m]."""
    reach = 0.0
    for k in range(len(tool.profile)):
        reach = max(reach, math.sqrt(tool.profile[k, 0] ** 2 + tool.profile[k, 1] ** 2 + tool.half_width**2))
    return reach


@kernel
def _wall_velocity(rotation: Array, linear: Array, angular: Array, c: Vector) -> Vector:
    """Return the velocity [m/s] of a tool point."""
    turning = cross((angular[0], angular[1], angular[2]), turned(rotation, c))
    return linear[0] + turning[0], linear[1] + turning[1], linear[2] + turning[2]


@kernel
def _give(
    pushes: Array, position: Array, rotation: Array, c: Vector, force: Vector, dt: float, normal: Vector, stopped: float
) -> None:
    """Add what a parcel gives to the tool point c: the opposite of a force [N] on it and of what `keep_out` stopped."""
    arm = turned(rotation, c)
    point = (position[0] + arm[0], position[1] + arm[1], position[2] + arm[2])
    add_impulse(pushes, point, force, -dt)
    add_impulse(pushes, point, normal, -stopped)


@kernel
def press_bucket(
    state: State, step: int, tool: ToolPath, opening_margin: float, law: Law, dt: float, pushes: Array
) -> None:
    """Add the forces of the bucket's plates on the awake parcels, and note where each is at the bucket.

    `step` is the number of the sub-step. A parcel `opening_margin` [m] behind the opening is sheltered: there is no
    ground for it. What parcels inside that are not load yet give to the plates is added to `pushes` (6,), as
    `impact.add_impulse` does.
    """
    position, rotation = tool.positions[step], tool.rotations[step]
    # Plain arrays: taking one out of a named tuple costs more than the contact.
    planes, profile, half_width = tool.planes, tool.profile, tool.half_width
    linear, angular = tool.linear, tool.angular
    positions, velocities, spins, radii = state.positions, state.velocities, state.spins, state.radii
    near_plate, shell, forces, torques = state.near_plate, state.shell, state.forces, state.torques
    asleep, masses, load = state.asleep, state.masses, state.load
    plates = state.plate_springs.shape[1]
    springs = state.plate_springs.reshape((-1, SPRINGS))
    reach = bucket_reach(tool)
    for i in range(len(radii)):
        shell[i] = OFF_BUCKET
        r = radii[i]
        q = to_tool(position, rotation, positions[i, 0], positions[i, 1], positions[i, 2])
        # One radius more than touching: contacts that have opened are seen, and forgotten.
        if asleep[i] or q[0] * q[0] + q[1] * q[1] + q[2] * q[2] > (reach + 2.0 * r) ** 2:
            continue
        depth = inside_depth(planes, 1, q)
        behind = planes[0, 3] - planes[0, 0] * q[0] - planes[0, 2] * q[2]  # the opening
        if depth > 0.0 and behind > opening_margin:
            shell[i] = SHELTERED
        if depth >= r and not near_plate[i]:
            continue
        near_plate[i] = 0
        for plate in range(len(profile) + 1):
            row = i * plates + plate
            p = planes[plate + 1]
            side = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] - p[3]
            if abs(side) >= r:
                forget(springs, row)
                continue
            c = nearest_on_plate(profile, planes, half_width, plate, q)
            gap = math.sqrt((q[0] - c[0]) ** 2 + (q[1] - c[1]) ** 2 + (q[2] - c[2]) ** 2)
            if gap >= r or gap < _HAIR_M:
                forget(springs, row)
                continue
            near_plate[i] = 1
            if side > 0.0:
                shell[i] = OUTSIDE_OF_SHELL
            n = turned(rotation, ((q[0] - c[0]) / gap, (q[1] - c[1]) / gap, (q[2] - c[2]) / gap))
            wall = _wall_velocity(rotation, linear, angular, c)
            v = (velocities[i, 0] - wall[0], velocities[i, 1] - wall[1], velocities[i, 2] - wall[2])
            closing = dot(v, n)
            v = keep_out(positions, velocities, i, n, gap, r, v, dt)
            w = (spins[i, 0], spins[i, 1], spins[i, 2])
            force, torque = wall_contact(springs, row, n, gap, v, w, masses[i], r, law, dt)
            if not load[i] and side <= 0.0:
                _give(pushes, position, rotation, c, force, dt, n, masses[i] * (dot(v, n) - closing))
            for a in range(3):
                forces[i, a] += force[a]
                torques[i, a] += torque[a]


@kernel
def to_box(box: BoxWalls, x: float, y: float) -> tuple[float, float]:
    """Turn a world point into the plane of the container."""
    a, b = x - box.x, y - box.y
    return box.cos * a + box.sin * b, -box.sin * a + box.cos * b


@kernel
def press_box(state: State, first: int, box: BoxWalls, law: Law, dt: float) -> None:
    """Add the forces of the four walls of the target box, plates from number `first` on, on the awake parcels."""
    positions, velocities, spins = state.positions, state.velocities, state.spins
    plates = state.plate_springs.shape[1]
    springs = state.plate_springs.reshape((-1, SPRINGS))
    masses, radii, asleep, forces, torques = state.masses, state.radii, state.asleep, state.forces, state.torques
    for i in range(len(masses)):
        r, z = radii[i], positions[i, 2]
        if asleep[i] or z > box.top_z + 2.0 * r:  # 1 r more: see to old contacts
            continue
        u, v = to_box(box, positions[i, 0], positions[i, 1])
        if abs(u) > box.half_x + 2.0 * r or abs(v) > box.half_y + 2.0 * r:
            continue
        for wall in range(4):
            row = i * plates + first + wall
            sign = 1.0 if wall % 2 == 0 else -1.0
            if wall < 2:
                cu, cv = sign * box.half_x, min(max(v, -box.half_y), box.half_y)
            else:
                cu, cv = min(max(u, -box.half_x), box.half_x), sign * box.half_y
            du, dv, dz = u - cu, v - cv, z - min(z, box.top_z)
            gap = math.sqrt(du * du + dv * dv + dz * dz)
            if gap >= r or gap < _HAIR_M:
                forget(springs, row)
                continue
            normal = ((box.cos * du - box.sin * dv) / gap, (box.sin * du + box.cos * dv) / gap, dz / gap)
            velocity = (velocities[i, 0], velocities[i, 1], velocities[i, 2])
            velocity = keep_out(positions, velocities, i, normal, gap, r, velocity, dt)
            spin = (spins[i, 0], spins[i, 1], spins[i, 2])
            force, torque = wall_contact(springs, row, normal, gap, velocity, spin, masses[i], r, law, dt)
            for a in range(3):
                forces[i, a] += force[a]
                torques[i, a] += torque[a]
