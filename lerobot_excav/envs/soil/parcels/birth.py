"""Birth of parcels: soil that enters the bucket gathers before it, and leaves as whole parcels where it was cut."""

from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.tool import ToolGeometry

_JITTER = 0.25
"""Largest random offset of a new parcel, in radii: no lattice builds up (guess)."""

_INSET = 0.9
"""Distance of a new parcel from plates and opening, in radii."""

_PASSES = 3


class Bins(NamedTuple):
    """Soil that waits before the opening of a bucket, in bins of about one parcel; lengths in the tool frame."""

    volumes: Array  # (a, b) waiting volumes along the opening, from edge to lip, and across it [m3]
    x: float  # of the edge [m]
    z: float  # of the edge [m]
    along_x: float  # x of the way from edge to lip over its squared length [1/m]
    along_z: float  # z of the same [1/m]
    width: float  # inner width of the bucket [m]


@kernel
def gather(bins: Bins, x: float, y: float, z: float, volume: float) -> None:
    """Book a volume [m3] in the bin of the opening before which a tool point [m] lies; `bins` changes in place."""
    volumes = bins.volumes
    share = (x - bins.x) * bins.along_x + (z - bins.z) * bins.along_z
    i = min(max(int(share * volumes.shape[0]), 0), volumes.shape[0] - 1)
    j = min(max(int((y / bins.width + 0.5) * volumes.shape[1]), 0), volumes.shape[1] - 1)
    volumes[i, j] += volume


@kernel
def move_inside(points: Array, planes: Array, inset: float) -> None:
    """Move (n, 3) tool points, in place, inside of (m, 4) half-spaces by a distance `inset` [m]."""
    for i in range(len(points)):
        for _ in range(_PASSES):
            for k in range(len(planes)):
                n0, n1, n2 = planes[k, 0], planes[k, 1], planes[k, 2]
                height = points[i, 0] * n0 + points[i, 1] * n1 + points[i, 2] * n2 - planes[k, 3]
                missing = max(0.0, height + inset)
                points[i, 0] -= missing * n0
                points[i, 1] -= missing * n1
                points[i, 2] -= missing * n2


class Intake:
    """Soil on its way into one bucket.

    Bins of about one parcel tile the opening. A parcel is born before the fullest bin as soon as all bins together
    hold one, so that never more than one parcel's volume waits, and new parcels keep apart like the soil they were.
    """

    def __init__(self, geometry: ToolGeometry, radius_m: float) -> None:
        self.geometry = geometry
        self._radius_m = radius_m
        self._edge, self._lip = geometry.profile_t[0], geometry.profile_t[-1]
        across = self._lip - self._edge
        length = float(np.linalg.norm(across))
        shape = (max(1, round(length / (2 * radius_m))), max(1, round(geometry.inner_width_m / (2 * radius_m))))
        (x, z), (along_x, along_z) = self._edge.tolist(), (across / length**2).tolist()
        self.bins = Bins(np.zeros(shape), x, z, along_x, along_z, float(geometry.inner_width_m))

    @property
    def waiting_m3(self) -> float:
        """Volume that has entered the bucket and is not yet a parcel."""
        return max(0.0, float(self.bins.volumes.sum()))

    def clear(self) -> None:
        """Forget what waits."""
        self.bins.volumes[:] = 0.0

    def births(self, parcel_m3: float, rng: Generator) -> Array:
        """Take whole parcels out of the bins; return where they begin, (n, 3) in the tool frame [m]."""
        count, volumes = int(self.waiting_m3 / parcel_m3), self.bins.volumes
        points = np.zeros((count, 3))
        if count == 0:
            return points
        for k in range(count):
            i, j = np.unravel_index(int(np.argmax(volumes)), volumes.shape)
            volumes[i, j] -= parcel_m3
            along, across = (i + 0.5) / volumes.shape[0], (j + 0.5) / volumes.shape[1]
            x, z = self._edge + along * (self._lip - self._edge)
            points[k] = x, (across - 0.5) * self.geometry.inner_width_m, z
        points += rng.uniform(-_JITTER, _JITTER, points.shape) * self._radius_m
        move_inside(points, self.geometry.planes_t, _INSET * self._radius_m)
        return points
