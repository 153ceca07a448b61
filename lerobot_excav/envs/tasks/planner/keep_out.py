"""Keep-out zones: rectangles of the ground in which nothing may be dug."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.tasks.planner.zones import Zone


def is_barred(
    centers_w: NDArray[np.float64], zones: Sequence[Zone], *, inner_radius_m: float, half_size_m: float
) -> NDArray[np.bool_]:
    """Tell which dig regions (n, 3) [m] touch a zone, or have a cut path that does.

    Region and path are one rectangle that points at the machine: as wide as the region, from its far edge to a radius
    around the swing axis. Two rectangles are apart if they are so along an edge of one of them (separating axes).
    """
    offset = centers_w[:, :2] - np.asarray(MACHINE_POS_W[:2])
    radius = np.hypot(*offset.T)
    along = offset / radius[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    near, far = np.minimum(inner_radius_m, radius - half_size_m), radius + half_size_m
    corners_w = np.asarray(MACHINE_POS_W[:2]) + np.stack(
        [r[:, None] * along + side * half_size_m * across for r in (near, far) for side in (-1.0, 1.0)], axis=1
    )
    barred = np.zeros(len(centers_w), dtype=bool)
    for x_low, y_low, x_high, y_high in zones:
        zone_w = np.array([[x, y] for x in (x_low, x_high) for y in (y_low, y_high)])
        apart = _are_apart(corners_w, zone_w, np.broadcast_to([1.0, 0.0], along.shape))
        for axis in (np.broadcast_to([0.0, 1.0], along.shape), along, across):
            apart |= _are_apart(corners_w, zone_w, axis)
        barred |= ~apart
    return barred


def _are_apart(
    corners_w: NDArray[np.float64], zone_w: NDArray[np.float64], axis: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Tell which of n rectangles (n, 4, 2) and a zone (4, 2) do not meet when seen along axes (n, 2)."""
    ours = np.einsum("nkd,nd->nk", corners_w, axis)
    theirs = axis @ zone_w.T
    return np.asarray((ours.max(axis=1) < theirs.min(axis=1)) | (theirs.max(axis=1) < ours.min(axis=1)))
