"""Which parcels have come to rest and become ground."""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.parcels.ground import Site, ground_below
from lerobot_excav.envs.soil.parcels.store import (
    OUTSIDE_OF_SHELL,
    TOUCHES_GROUND,
    TOUCHES_NOTHING,
    TOUCHES_OUTSIDE,
    State,
)

SETTLING_SPEED_M_S = 0.4
"""A parcel on the ground slower than this merges with it (soil.md: 0.3 to 0.5 m/s)."""

SETTLING_TIME_S = 0.1
"""How long it has to be so slow."""

DROPPING_TIME_S = 1.0
"""How long a parcel may rest on steel or on others before it drops to the ground below (guess)."""


@kernel
def find_settled(state: State, site: Site, bucket: Array, reach: float, pace: float, dt: float) -> Bools:
    """Return which parcels (n,) have come to rest, and keep `calm_s` and `ground` of the state up to date.

    Within `reach` of the `bucket` (3,) [m] only what is slower than `pace` [m/s] may be at rest. What has rested long
    without ground is taken to lie on what is below it.
    """
    gone = np.zeros(len(state.masses), dtype=np.bool_)
    positions, velocities, calm_s, ground = state.positions, state.velocities, state.calm_s, state.ground
    load, asleep, shell = state.load, state.asleep, state.shell
    for i in range(len(gone)):
        if load[i] or asleep[i]:
            calm_s[i] = 0.0
            continue
        limit, away, speed = SETTLING_SPEED_M_S, 0.0, 0.0
        for a in range(3):
            away += (positions[i, a] - bucket[a]) ** 2
            speed += velocities[i, a] ** 2
        if away < reach**2:
            limit = min(limit, pace)
        calm_s[i] = calm_s[i] + dt if speed < limit**2 else 0.0
        if calm_s[i] >= DROPPING_TIME_S and ground[i] == TOUCHES_NOTHING:
            ground[i] = ground_below(site, positions[i, 0], positions[i, 1])[0]
        caught = shell[i] == OUTSIDE_OF_SHELL and ground[i] == TOUCHES_GROUND
        rests = ground[i] != TOUCHES_NOTHING and calm_s[i] >= SETTLING_TIME_S
        gone[i] = caught or rests or ground[i] == TOUCHES_OUTSIDE
    return gone
