"""Motion of the parcels: contact forces and semi-implicit Euler sub-steps."""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array, Indices
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.parcels.contact import Law, contact, cross, dot, forget
from lerobot_excav.envs.soil.parcels.ground import Site, press_ground
from lerobot_excav.envs.soil.parcels.impact import add_impulse
from lerobot_excav.envs.soil.parcels.pairs import Pairs, find_pairs, is_outdated
from lerobot_excav.envs.soil.parcels.plates import ToolPath, press_box, press_bucket, turned
from lerobot_excav.envs.soil.parcels.store import OFF_BUCKET, TOUCHES_NOTHING, State

LARGEST_SPEED_M_S = 12.0
"""Speed limit of a parcel: a fall from 7 m. Above, it could pass through a plate."""

WAKING_SPEED_M_S = 0.3
"""A parcel that hits the sleeping load faster than this wakes it (guess)."""


class Laws(NamedTuple):
    """Coefficients of the contacts between parcels, with the ground and with steel."""

    parcel: Law
    ground: Law
    steel: Law


@kernel
def carry(state: State, tool: ToolPath, step: int) -> None:
    """Move the sleeping parcels of a state, in place, to where they lie in the bucket at its pose number `step`."""
    position, rotation = tool.positions[step], tool.rotations[step]
    w = (tool.angular[0], tool.angular[1], tool.angular[2])
    asleep, places, linear = state.asleep, state.places_t, tool.linear
    positions, velocities, spins = state.positions, state.velocities, state.spins
    for i in range(len(asleep)):
        if asleep[i]:
            arm = turned(rotation, (places[i, 0], places[i, 1], places[i, 2]))
            turning = cross(w, arm)
            for a in range(3):
                positions[i, a] = position[a] + arm[a]
                velocities[i, a] = linear[a] + turning[a]
                spins[i, a] = w[a]


@kernel
def press_pairs(state: State, pairs: Pairs, law: Law, dt: float, pushes: Array) -> float:
    """Add the forces of touching parcels on each other; change the memory of their contacts.

    What others give to the load is added to `pushes` (6,), as `impact.add_impulse` does.
    Returns the fastest closing speed between a sleeping parcel and one that is awake [m/s].
    """
    positions, velocities, spins = state.positions, state.velocities, state.spins
    masses, radii, asleep, load = state.masses, state.radii, state.asleep, state.load
    forces, torques, springs = state.forces, state.torques, pairs.springs
    hit = 0.0
    for i in range(len(masses)):
        ri = radii[i]
        for k in range(pairs.start[i], pairs.start[i + 1]):
            j = pairs.partner[k]
            rj = radii[j]
            d0 = positions[i, 0] - positions[j, 0]
            d1 = positions[i, 1] - positions[j, 1]
            d2 = positions[i, 2] - positions[j, 2]
            far = d0 * d0 + d1 * d1 + d2 * d2
            if far >= (ri + rj) * (ri + rj) or far == 0.0:
                if pairs.closed[k]:
                    forget(springs, k)
                    pairs.closed[k] = 0
                continue
            pairs.closed[k] = 1
            distance = math.sqrt(far)
            n = (d0 / distance, d1 / distance, d2 / distance)
            ai, aj = distance * ri / (ri + rj), distance * rj / (ri + rj)  # arms to the middle of the lens
            wi, wj = (spins[i, 0], spins[i, 1], spins[i, 2]), (spins[j, 0], spins[j, 1], spins[j, 2])
            turning = cross((ai * wi[0] + aj * wj[0], ai * wi[1] + aj * wj[1], ai * wi[2] + aj * wj[2]), n)
            velocity = (
                velocities[i, 0] - velocities[j, 0] - turning[0],
                velocities[i, 1] - velocities[j, 1] - turning[1],
                velocities[i, 2] - velocities[j, 2] - turning[2],
            )
            arm = ai * aj / (ai + aj)
            rolling = cross((wi[0] - wj[0], wi[1] - wj[1], wi[2] - wj[2]), n)
            rolling = (arm * rolling[0], arm * rolling[1], arm * rolling[2])
            mass = masses[i] * masses[j] / (masses[i] + masses[j])
            if asleep[i] != asleep[j]:
                mass = masses[j] if asleep[i] else masses[i]
                hit = max(hit, -dot(velocity, n))
            force, roll = contact(springs, k, n, ri + rj - distance, velocity, rolling, mass, min(ri, rj), law, dt)
            if load[i] != load[j]:
                lens = (positions[i, 0] - ai * n[0], positions[i, 1] - ai * n[1], positions[i, 2] - ai * n[2])
                add_impulse(pushes, lens, force, dt if load[i] else -dt)
            torque, rolling_torque = cross(n, force), cross(n, roll)
            for a in range(3):
                forces[i, a] += force[a]
                forces[j, a] -= force[a]
                torques[i, a] += -ai * torque[a] + arm * rolling_torque[a]
                torques[j, a] += -aj * torque[a] - arm * rolling_torque[a]
    return hit


@kernel
def _integrate(state: State, dt: float) -> None:
    """Advance the awake parcels: velocities first, then positions with the new velocities."""
    positions, velocities, spins, masses = state.positions, state.velocities, state.spins, state.masses
    radii, asleep, forces, torques = state.radii, state.asleep, state.forces, state.torques
    for i in range(len(masses)):
        if asleep[i]:
            continue
        inertia = 0.4 * masses[i] * radii[i] ** 2
        speed = 0.0
        for a in range(3):
            velocities[i, a] += dt * forces[i, a] / masses[i]
            spins[i, a] += dt * torques[i, a] / inertia
        velocities[i, 2] -= dt * GRAVITY_M_S2
        for a in range(3):
            speed += velocities[i, a] ** 2
        if speed > LARGEST_SPEED_M_S**2:
            share = LARGEST_SPEED_M_S / math.sqrt(speed)
            for a in range(3):
                velocities[i, a] *= share
        for a in range(3):
            positions[i, a] += dt * velocities[i, a]


@kernel
def greatest(heights: Array) -> float:
    """Return the greatest of some heights (nx, ny) [m]."""
    most = heights[0, 0]
    for i in range(heights.shape[0]):
        for j in range(heights.shape[1]):
            most = max(most, heights[i, j])
    return float(most)


@kernel
def advance(
    state: State,
    pairs: Pairs,
    spare: Pairs,
    old_rows: Indices,
    tool: ToolPath,
    site: Site,
    laws: Laws,
    dt: float,
    steps: int,
    pushes: Array,
) -> tuple[Pairs, Pairs, float]:
    """Advance all parcels, in place, by some sub-steps of `dt` [s].

    `pairs` are the neighbours of the last call, in which the parcels had the rows `old_rows` (n,), -1 for a new one;
    `spare` is another list as large, whose content does not matter.
    What others than the load and the ground give to load and plates is added to `pushes` (6,), as `add_impulse` does.
    Returns the neighbours now, the other list, and the fastest hit on a sleeping parcel [m/s].
    """
    highest = max(greatest(site.heights), site.level_z)
    if site.box.half_x > 0.0:
        highest = max(highest, site.box.floor_z + greatest(site.box_heights))
    new = find_pairs(state.positions, state.radii, state.asleep, pairs, old_rows, spare)
    pairs, spare = new, pairs
    same_rows = np.zeros(len(state.masses), dtype=np.int64)
    for i in range(len(same_rows)):
        same_rows[i] = i
    walls = len(tool.profile) + 1
    hit = 0.0
    state.ground[:] = TOUCHES_NOTHING
    for step in range(steps):
        if tool.present:
            carry(state, tool, step)
        if is_outdated(state.positions, state.radii, pairs.anchors):
            new = find_pairs(state.positions, state.radii, state.asleep, pairs, same_rows, spare)
            pairs, spare = new, pairs
        state.forces[:] = 0.0
        state.torques[:] = 0.0
        hit = max(hit, press_pairs(state, pairs, laws.parcel, dt, pushes))
        if tool.present:
            press_bucket(state, step, tool, site.grid.dx, laws.steel, dt, pushes)
        press_ground(state, site, highest, laws.ground, dt)
        if site.box.half_x > 0.0:
            press_box(state, walls, site.box, laws.steel, dt)
        _integrate(state, dt)
    if tool.present:
        carry(state, tool, steps)
    else:
        state.shell[:] = OFF_BUCKET
    return pairs, spare, hit
