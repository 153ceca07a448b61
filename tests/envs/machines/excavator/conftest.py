"""The machine and its model, and a soil whose parcels are given, for pictures."""

import copy

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.excavator.mjcf import build_spec
from lerobot_excav.envs.soil import Soil

PARCEL_RADIUS_M = 0.045


def skin_mesh(model, name):
    """The vertices (n, 3) of a skin, and its faces (m, 3) as numbers of vertices."""
    skin = model.skin(name).id
    first, start = model.skin_faceadr[skin], model.skin_vertadr[skin]
    faces = model.skin_face[first : first + model.skin_facenum[skin]]
    return model.skin_vert[start : start + model.skin_vertnum[skin]], faces


@pytest.fixture(scope="session")
def compiled():
    """The model as built, which nobody may change."""
    return build_spec().compile()


@pytest.fixture
def model(compiled):
    return copy.copy(compiled)


@pytest.fixture(scope="module")
def machine():
    """A machine in whatever pose the last test has left it."""
    return ExcavatorMachine()


class SoilWithParcels(Soil):
    """A level soil with parcels at given points, all with one velocity."""

    def __init__(self, positions=(), *, is_load=False, velocity=(0.0, 0.0, 0.0)):
        super().__init__(container=TARGET_BOX)
        self._shown = np.array(positions, dtype=float).reshape(-1, 3)
        self._is_load = np.broadcast_to(np.array(is_load, dtype=bool), len(self._shown))
        self._velocity = np.array(velocity)

    parcel_positions_w = property(lambda self: self._shown)
    parcel_velocities_w = property(lambda self: np.tile(self._velocity, (len(self._shown), 1)))
    parcel_radii_m = property(lambda self: np.full(len(self._shown), PARCEL_RADIUS_M))
    parcel_is_load = property(lambda self: self._is_load)


soil_with_parcels = pytest.fixture(lambda: SoilWithParcels)
