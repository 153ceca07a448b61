"""Twin of `parcels.pairs` and of the pair forces of `parcels.dynamics`: every parcel against every other."""

from itertools import combinations

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Flags
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.pairs import SKIN
from lerobot_excav.envs.soil.parcels.store import State
from validation.soil.reference.contact import contact

Memory = dict[tuple[int, int], Array]
"""Springs (6,) of each touching pair i < j [m]."""


def neighbours(positions: Array, radii: Array, asleep: Flags) -> set[tuple[int, int]]:
    """Return all pairs i < j that are nearer than the skin and not both asleep."""
    skin = SKIN * float(radii.max())
    return {
        (i, j)
        for i, j in combinations(range(len(positions)), 2)
        if np.linalg.norm(positions[i] - positions[j]) < radii[i] + radii[j] + skin and not (asleep[i] and asleep[j])
    }


def press_pairs(state: State, memory: Memory, law: Law, dt: float, pushes: Array) -> float:
    """Add the forces of all touching pairs to a state, and what others give to the load to `pushes`.

    Returns the fastest hit on a sleeping parcel [m/s].
    """
    hit = 0.0
    for i, j in combinations(range(len(state.masses)), 2):
        apart = state.positions[i] - state.positions[j]
        distance, reach = float(np.linalg.norm(apart)), float(state.radii[i] + state.radii[j])
        if distance >= reach or (state.asleep[i] and state.asleep[j]):
            memory.pop((i, j), None)
            continue
        normal = apart / distance
        arm_i, arm_j = -distance * state.radii[i] / reach * normal, distance * state.radii[j] / reach * normal
        velocity = (state.velocities[i] + np.cross(state.spins[i], arm_i)) - (
            state.velocities[j] + np.cross(state.spins[j], arm_j)
        )
        lengths = float(np.linalg.norm(arm_i)), float(np.linalg.norm(arm_j))
        arm = lengths[0] * lengths[1] / (lengths[0] + lengths[1])
        rolling = -arm * np.cross(normal, state.spins[i] - state.spins[j])
        mass = 1.0 / sum(1.0 / state.masses[k] for k in (i, j) if not state.asleep[k])
        if state.asleep[i] or state.asleep[j]:
            hit = max(hit, -float(velocity @ normal))
        radius = float(min(state.radii[i], state.radii[j]))
        springs = memory.setdefault((i, j), np.zeros(6))
        force, roll = contact(springs, normal, reach - distance, velocity, rolling, mass, radius, law, dt)
        for own, other, sign, arm_w in ((i, j, 1.0, arm_i), (j, i, -1.0, arm_j)):
            if state.load[own] and not state.load[other]:
                pushes += np.concatenate([sign * force, np.cross(state.positions[own] + arm_w, sign * force)]) * dt
        state.forces[i] += force
        state.forces[j] -= force
        state.torques[i] += np.cross(arm_i, force) + arm * np.cross(normal, roll)
        state.torques[j] += np.cross(arm_j, -force) - arm * np.cross(normal, roll)
    return hit
