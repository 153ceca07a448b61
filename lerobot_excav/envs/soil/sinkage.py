"""How far the soil under each piece of a bucket has been pressed down.

Vertical motion alone adds to it. Level travel brings fresh soil under a piece, whatever its direction: the sinkage is
renewed over the distance from the front of the contact.
"""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M


@kernel
def renewal_lengths(points: Array, shares: Array, is_edge: Bools, velocity: Array, width: float) -> Array:
    """Return after how much level travel fresh soil lies under each piece [m].

    It is the distance from the front of the contact, over the buried pieces of the shell, each as wide as a row. The
    edge is a contact of its own, as long as it is thick.
    """
    lengths, ways = np.zeros(len(points)), np.zeros(len(points))
    speed = math.sqrt(velocity[0] ** 2 + velocity[1] ** 2)
    front = -math.inf
    for k in range(len(points)):
        lengths[k] = PLATE_THICKNESS_M
        if speed == 0.0:
            continue
        ways[k] = (points[k, 0] * velocity[0] + points[k, 1] * velocity[1]) / speed
        if shares[k] > 0.0 and not is_edge[k]:
            front = max(front, ways[k] + 0.5 * width)
    for k in range(len(points)):
        if speed > 0.0 and not is_edge[k]:
            lengths[k] = max(PLATE_THICKNESS_M, front - ways[k])
    return lengths


@kernel
def press_down(
    sinkages: Array, grounds: Array, shares: Array, zs: Array, velocities: Array, lengths: Array, dt: float
) -> None:
    """Bring sinkages up to date: what the soil under each piece was pressed down, renewed over a length of travel.

    `grounds` is the level of the ground around each (`surroundings`): nothing has sunk in deeper than that.
    """
    for k in range(len(sinkages)):
        if shares[k] <= 0.0:
            sinkages[k] = 0.0
            continue
        travel = dt * math.sqrt(velocities[k, 0] ** 2 + velocities[k, 1] ** 2)
        sunk = math.exp(-travel / lengths[k]) * (sinkages[k] - dt * velocities[k, 2])
        sinkages[k] = min(max(sunk, 0.0), max(grounds[k] - zs[k], 0.0))
