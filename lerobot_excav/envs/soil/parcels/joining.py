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

CROWDED = 0.7
"""Distance of two centres over the sum of radii, below which they cannot have been soil side by side (guess)."""

CROWDED_REACH = 4.0
"""Distance, in its radii, within which a parcel that is born into another one may join a third."""


@kernel
def _nearest(
    positions: Array, masses: Array, radii: Array, others: Indices, count: int, k: int, most_kg: float, spacing: float
) -> tuple[bool, float, int]:
    """Look through the first `count` of other parcels, by row.

    Returns whether parcel k is nearer to one than `spacing` times the sum of radii, the square distance to the nearest
    with room for its mass, and the row of that, -1 if none has room.
    """
    crowded, best, partner = False, math.inf, -1
    for i in others[:count]:
        far = 0.0
        for a in range(3):
            far += (positions[i, a] - positions[k, a]) ** 2
        crowded = crowded or far < (spacing * (radii[i] + radii[k])) ** 2
        if far < best and masses[i] + masses[k] <= most_kg:
            best, partner = far, i
    return crowded, best, partner


@kernel
def join(
    positions: Array,
    velocities: Array,
    masses: Array,
    radii: Array,
    asleep: Flags,
    free: int,
    most_kg: float,
    spacing: float,
) -> Flags:
    """Find a place for new parcels, one after the other.

    Args:
        positions: (n, 3) centres [m] of the parcels there are and of the new ones after them. Where a new one joins,
            these four change in place, and mass, momentum, centre of mass and density are kept.
        velocities: (n, 3) the same [m/s].
        masses: (n,) the same [kg].
        radii: (n,) the same [m].
        asleep: (old,) of the parcels there are; a sleeping one is left alone.
        free: How many of the new ones may stay parcels.
        most_kg: Largest mass to which parcels may grow.
        spacing: A new one nearer to another one than this share of the sum of radii joins that, or one near it.

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
        crowded, best, partner = _nearest(positions, masses, radii, others, count, k, most_kg, spacing)
        if free > 0 and not crowded:
            free -= 1
            others[count] = k
            count += 1
        elif partner < 0 or (free > 0 and best > (CROWDED_REACH * radii[k]) ** 2):
            fate[k] = WITHOUT_ROOM
        else:
            fate[k] = JOINED
            share = masses[k] / (masses[partner] + masses[k])
            for a in range(3):
                positions[partner, a] += share * (positions[k, a] - positions[partner, a])
                velocities[partner, a] += share * (velocities[k, a] - velocities[partner, a])
            radii[partner] *= (1.0 + masses[k] / masses[partner]) ** (1.0 / 3.0)
            masses[partner] += masses[k]
    return fate
