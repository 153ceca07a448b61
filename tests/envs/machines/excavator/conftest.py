"""A soil whose parcels are given, for pictures."""

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil import Soil

PARCEL_RADIUS_M = 0.045


class SoilWithParcels(Soil):
    """A level soil with parcels at given points, all with one velocity."""

    def __init__(self, positions=(), *, is_load=(), velocity=(0.0, 0.0, 0.0)):
        super().__init__(container=TARGET_BOX)
        self._shown = np.array(positions, dtype=float).reshape(-1, 3)
        self._is_load = np.array(is_load, dtype=bool)
        self._velocity = np.array(velocity)

    parcel_positions_w = property(lambda self: self._shown)
    parcel_velocities_w = property(lambda self: np.tile(self._velocity, (len(self._shown), 1)))
    parcel_radii_m = property(lambda self: np.full(len(self._shown), PARCEL_RADIUS_M))
    parcel_is_load = property(lambda self: self._is_load)


@pytest.fixture
def soil_with_parcels():
    """Make a `SoilWithParcels`."""
    return SoilWithParcels


@pytest.fixture
def heaped_load():
    """Parcels of a heaped bucket, (n, 3) [m] in the tool frame."""
    x, y, z = np.meshgrid(np.arange(0.4, 1.0, 0.08), np.arange(-0.3, 0.31, 0.08), np.arange(-0.1, 0.35, 0.08))
    places_t = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return places_t[places_t[:, 2] < 1.0 - places_t[:, 0]]
