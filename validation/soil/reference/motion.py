"""Twin of `parcels.dynamics`: one whole sub-step."""

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.parcels.dynamics import LARGEST_SPEED_M_S, Laws
from lerobot_excav.envs.soil.parcels.ground import Site
from lerobot_excav.envs.soil.parcels.plates import ToolPath
from lerobot_excav.envs.soil.parcels.store import OFF_BUCKET, TOUCHES_NOTHING, State
from validation.soil.reference.ground import press_ground
from validation.soil.reference.pairs import Memory, press_pairs
from validation.soil.reference.plates import press_box, press_bucket


def carry(state: State, tool: ToolPath, step: int) -> None:
    """Move the sleeping parcels with the bucket."""
    for i in np.flatnonzero(state.asleep):
        arm = tool.rotations[step] @ state.places_t[i]
        state.positions[i] = tool.positions[step] + arm
        state.velocities[i] = tool.linear + np.cross(tool.angular, arm)
        state.spins[i] = tool.angular


def integrate(state: State, dt: float) -> None:
    """Advance the awake parcels by semi-implicit Euler."""
    for i in np.flatnonzero(state.asleep == 0):
        mass, radius = float(state.masses[i]), float(state.radii[i])
        state.velocities[i] += dt * (state.forces[i] / mass - np.array([0.0, 0.0, GRAVITY_M_S2]))
        state.spins[i] += dt * state.torques[i] / (2.0 / 5.0 * mass * radius**2)
        speed = float(np.linalg.norm(state.velocities[i]))
        state.velocities[i] *= min(1.0, LARGEST_SPEED_M_S / speed) if speed > 0.0 else 1.0
        state.positions[i] += dt * state.velocities[i]


def advance(
    state: State, memory: Memory, tool: ToolPath, site: Site, laws: Laws, dt: float, steps: int, pushes: Array
) -> float:
    """Advance all parcels by some sub-steps and add up the pushes on the load.

    Returns the fastest hit on a sleeping parcel [m/s].
    """
    hit = 0.0
    state.ground[:] = TOUCHES_NOTHING
    for step in range(steps):
        state.forces[:] = 0.0
        state.torques[:] = 0.0
        if tool.present:
            carry(state, tool, step)
        hit = max(hit, press_pairs(state, memory, laws.parcel, dt, pushes))
        if tool.present:
            press_bucket(state, step, tool, site.grid.dx, laws.steel, dt, pushes)
        press_ground(state, site, laws.ground, dt)
        if site.box.half_x > 0.0:
            press_box(state, len(tool.profile) + 1, site.box, laws.steel, dt)
        integrate(state, dt)
    if tool.present:
        carry(state, tool, steps)
    else:
        state.shell[:] = OFF_BUCKET
    return hit
