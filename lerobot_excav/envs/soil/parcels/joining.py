"""New parcels that find no room of their own: they join others, or lie on the ground at once."""

import math

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Flags, Indices
from lerobot_excav.envs.soil.compiled import kernel

STAYS, JOINED, WITHOUT_ROOM = range(3)
"""What becomes of a parcel."""

MOST_JOINED = 4.0
"""Largest mass of a parcel that others have joined, in whole ones: 1.6 times as wide. Were a few parcels to take up
all that comes, each would touch all others, and a step would last for seconds (tuned)."""

CROWDED = 1.0
"""Distance between centres, in radii, below which two parcels cannot have been soil side by side (guess)."""

CROWDED_REACH = 4.0
"""Distance, in radii, within which a parcel that is born into another one may join a third."""


@kernel
def _nearest(
    positions: Array, masses: Array, others: Indices, count: int, k: int, most_kg: float
) -> tuple[float, float, int]:
    """Look through the first `count` of other parcels, by row.

    Returns the square distance from parcel k to the nearest one, that to the nearest with room for its mass, and the
    row of the latter, -1 if none has room.
    """
    nearest, best, partner = math.inf, math.inf, -1
    for i in others[:count]:
        far = 0.0
        for a in range(3):
            far += (positions[i, a] - positions[k, a]) ** 2
        nearest = min(nearest, far)
        if far < best and masses[i] + masses[k] <= most_kg:
            best, partner = far, i
    return nearest, best, partner


@kernel
def join(
    positions: Array, velocities: Array, masses: Array, asleep: Flags, free: int, most_kg: float, radius: float
) -> Flags:
    """Find a place for new parcels, one after the other.

    Args:
        positions: (n, 3) centres [m] of the parcels there are and of the new ones after them. Where a new one joins,
            these three change in place, and mass, momentum and centre of mass are kept.
        velocities: (n, 3) the same [m/s].
        masses: (n,) the same [kg].
        asleep: (old,) of the parcels there are; a sleeping one is left alone.
        free: How many of the new ones may stay parcels.
        most_kg: Largest mass to which parcels may grow.
        radius: A new one nearer than `CROWDED` of these [m] to another one joins that or one near it; 0: it need not.

    Returns:
        (n,) what becomes of each: it stays, it has joined the nearest one with room for its mass, or none has room.
    """
    old = len(asleep)
    fate = np.zeros(len(masses), dtype=np.uint8)
    others, count = np.zeros(old + free, dtype=np.int64), 0
    for i in range(old):
        if not asleep[i]:
            others[count] = i
            count += 1
    for k in range(old, len(masses)):
        nearest, best, partner = _nearest(positions, masses, others, count, k, most_kg)
        if free > 0 and nearest >= (CROWDED * radius) ** 2:
            free -= 1
            others[count] = k
            count += 1
        elif partner < 0 or (free > 0 and best > (CROWDED_REACH * radius) ** 2):
            fate[k] = WITHOUT_ROOM
        else:
            fate[k] = JOINED
            share = masses[k] / (masses[partner] + masses[k])
            for a in range(3):
                positions[partner, a] += share * (positions[k, a] - positions[partner, a])
                velocities[partner, a] += share * (velocities[k, a] - velocities[partner, a])
            masses[partner] += masses[k]
    return fate
