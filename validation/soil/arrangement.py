"""Parcels placed at rest at their packing density, without overlap."""

import math

import numpy as np

from lerobot_excav.envs.soil import Soil
from validation import Array

CLOSE_PACKING = math.pi / math.sqrt(18.0)
"""Solid fraction of the densest arrangement of equal spheres."""

_JITTER = 0.45
"""Largest displacement of a parcel, as a share of the gap to its neighbours; below 0.5 none can overlap."""


def hexagonal_lattice(half_size_m: float, height_m: float, soil: Soil) -> tuple[Array, float]:
    """Return a close-packed lattice stretched to the parcels' own packing, and the gap between neighbours [m].

    The (n, 3) points [m] cover at least the square |x|, |y| <= half_size_m, in layers from the radius of a parcel up.
    """
    stretch = (CLOSE_PACKING / soil.parameters.parcel_solid_fraction) ** (1.0 / 3.0)
    spacing = 2.0 * soil.parcel_radius_m * stretch
    rows = math.ceil(half_size_m / (spacing * math.sqrt(0.75))) + 1
    columns = math.ceil(half_size_m / spacing) + 1
    layers = max(1, round(height_m / (spacing * math.sqrt(2.0 / 3.0))))
    i, j, k = np.meshgrid(
        np.arange(-columns, columns + 1), np.arange(-rows, rows + 1), np.arange(layers), indexing="ij"
    )
    x = spacing * (i + 0.5 * (j % 2) + 0.5 * (k % 2))
    y = spacing * (math.sqrt(0.75) * j + math.sqrt(1.0 / 12.0) * (k % 2))
    z = soil.parcel_radius_m + spacing * math.sqrt(2.0 / 3.0) * k
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    return points, spacing - 2.0 * soil.parcel_radius_m


def cylinder(radius_m: float, height_m: float, soil: Soil, rng: np.random.Generator) -> Array:
    """Return the (n, 3) centres of parcels that fill a cylinder on the plane z = 0 about the z axis [m].

    The lattice is turned and shifted at random and every parcel displaced a little, so that seeds differ. The centres
    keep the radius; the height is met to half a layer.
    """
    points, gap = hexagonal_lattice(radius_m + 4.0 * soil.parcel_radius_m, height_m, soil)
    angle = rng.uniform(0.0, 2.0 * math.pi)
    cos, sin = math.cos(angle), math.sin(angle)
    points[:, :2] += rng.uniform(-1.0, 1.0, 2) * soil.parcel_radius_m
    points[:, :2] = points[:, :2] @ np.array([[cos, sin], [-sin, cos]])
    points = points[np.hypot(points[:, 0], points[:, 1]) <= radius_m]
    shift = rng.normal(size=points.shape)
    shift *= (_JITTER * gap * rng.uniform(size=len(points)) / np.linalg.norm(shift, axis=1))[:, None]
    shift[:, 2] = np.abs(shift[:, 2])  # nobody starts inside the floor
    return points + shift
