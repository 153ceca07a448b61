"""A rehearsal: a bit of everything that a step can need, so that its kernels are compiled before an episode begins."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.worksite import Worksite, WorksiteStart
from lerobot_excav.envs.soil.compiled import announced

_GROUND_M = 0.8
_PIN = (4.6, 0.35, -1.9, 0.0)
"""Radius and height of the cutting edge [m], pitch and swing of the bucket [rad]: in the ground."""

_TICKS = 20
"""Enough to dig a few parcels, and for loose soil to come to rest."""


@cache
def rehearse() -> None:
    """Compile, or load, all kernels of the worksite, once per process; what is compiled is announced on stderr.

    Numba compiles a kernel when it is first called, with everything that it calls itself. So it does not matter how
    much is dug here: only that each kernel is called once, with the types that it will meet later.
    """
    with announced():
        site = Worksite(fidelity="fast")
        start = inverse(*_PIN)
        assert start is not None  # a pose of our own choice
        heights: NDArray[np.float64] = np.full(site.soil.heights_m.shape, _GROUND_M)
        site.reset(WorksiteStart(joint_pos=start, heights_m=heights, appearance=Appearance()))
        site.soil.height_at(np.zeros(2))
        site.soil.add_parcels(*_loose_soil(site.soil.parcel_radius_m))
        for _ in range(_TICKS):
            site.tick(np.array([0.2, 0.1, -1.0, -0.5]))


def _loose_soil(radius_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places and velocities of parcels that lie on the ground, in the box and beside both.

    Two collide, and of six in one place some join and one finds no room.
    """
    above = _GROUND_M + radius_m
    places = [[2.0, 2.0, above], [2.0, 2.0, above + 1.5 * radius_m], [*TARGET_BOX.center_w[:2], radius_m]]
    places += [[4.0, 0.0, radius_m], *[[1.0, 2.0, above]] * 6]
    return np.array(places), np.zeros((len(places), 3))
