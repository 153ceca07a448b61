"""The parcels' state: plain arrays with room to grow, one row per parcel."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.arrays import Array, Bools, Flags

WALLS = 4
"""Plates of the target box."""

TOUCHES_NOTHING, TOUCHES_GROUND, TOUCHES_BOX_FLOOR, TOUCHES_OUTSIDE = range(4)
"""What a parcel lies on: the dig area, the floor (or soil) of the target box, the level ground around."""


OFF_BUCKET, OUTSIDE_OF_SHELL, SHELTERED = range(3)
"""Where a parcel is: not touching the shell from outside, doing so, deep inside the bucket."""


class State(NamedTuple):
    """Arrays of all parcels in the form that kernels take; z counts from the rigid floor."""

    positions: Array  # (n, 3) centres [m]
    velocities: Array  # (n, 3) [m/s]
    spins: Array  # (n, 3) angular velocities [rad/s]
    masses: Array  # (n,) [kg]
    radii: Array  # (n,) [m]
    forces: Array  # (n, 3) of the present sub-step [N]
    torques: Array  # (n, 3) of the present sub-step [N m]
    places_t: Array  # (n, 3) centres in the tool frame, of parcels asleep in the bucket [m]
    calm_s: Array  # (n,) how long each has rested on the ground [s]
    asleep: Flags  # (n,) 1 if it rests in the bucket and moves with it
    load: Flags  # (n,) 1 if it belongs to the bucket's load
    ground: Flags  # (n,) what it last touched below in this step, one of `TOUCHES_…`
    on_ground: Flags  # (n,) 1 if it touches the ground in this sub-step
    shell: Flags  # (n,) where it is at the bucket, one of `OFF_BUCKET`, `OUTSIDE_OF_SHELL`, `SHELTERED`
    near_plate: Flags  # (n,) 1 if it touched a plate of the bucket when last looked at
    ground_springs: Array  # (n, 6) memory of the contact with the ground [m]
    plate_springs: Array  # (n, plates, 6) memory of the contacts with plates of bucket and box [m]


def empty_state(count: int, plates: int) -> State:
    """Return rows of zeros for a number of parcels and of plates that they may touch."""
    return State(
        positions=np.zeros((count, 3)),
        velocities=np.zeros((count, 3)),
        spins=np.zeros((count, 3)),
        masses=np.zeros(count),
        radii=np.zeros(count),
        forces=np.zeros((count, 3)),
        torques=np.zeros((count, 3)),
        places_t=np.zeros((count, 3)),
        calm_s=np.zeros(count),
        asleep=np.zeros(count, dtype=np.uint8),
        load=np.zeros(count, dtype=np.uint8),
        ground=np.zeros(count, dtype=np.uint8),
        on_ground=np.zeros(count, dtype=np.uint8),
        shell=np.zeros(count, dtype=np.uint8),
        near_plate=np.zeros(count, dtype=np.uint8),
        ground_springs=np.zeros((count, 6)),
        plate_springs=np.zeros((count, plates, 6)),
    )


def rows(state: State, count: int) -> State:
    """Return views of the first rows."""
    return State._make(array[:count] for array in state)


def copy_rows(source: State, target: State) -> None:
    """Copy all rows of a state to the first rows of another one that is as large or larger."""
    arrays: list[tuple[NDArray[Any], NDArray[Any]]] = list(zip(source, target, strict=True))
    for old, new in arrays:
        new[: len(old)] = old


def keep(state: State, kept: Bools) -> int:
    """Move the kept rows to the front, in their order; return their number."""
    count = int(kept.sum())
    for array in state:
        array[:count] = array[kept]
    return count
