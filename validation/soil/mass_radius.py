"""How far the mass of a heap reaches from the z axis."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil import Soil

Array = NDArray[np.float64]


def share_radius(radii_m: Array, masses_kg: Array, share: float) -> float:
    """Return the radius [m] that holds a share of the mass, linear between the sorted radii.

    Args:
        radii_m: (n,) distances from the axis.
        masses_kg: (n,) masses there; any unit will do.
        share: In (0, 1).
    """
    order = np.argsort(radii_m)
    reached = np.cumsum(masses_kg[order])
    return float(np.interp(share * reached[-1], reached, radii_m[order]))


def mass_radius(soil: Soil, share: float) -> float:
    """Return the radius [m] about the z axis that holds a share of the soil on the ground and in parcels."""
    x, y = np.meshgrid(soil.x_w, soil.y_w, indexing="ij")
    heights = soil.heights_m
    total = float(heights.sum())
    cell_kg = soil.ledger_kg()["grid"] / total if total > 0.0 else 0.0
    parcels = soil.parcel_positions_w
    return share_radius(
        np.concatenate([np.hypot(x, y).ravel(), np.hypot(parcels[:, 0], parcels[:, 1])]),
        np.concatenate([heights.ravel() * cell_kg, soil.parcel_masses_kg]),
        share,
    )
