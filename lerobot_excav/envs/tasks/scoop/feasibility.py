"""Where on a pile a scoop can be commanded: what the machine reaches, the bucket can fill at, and the camera sees."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.cameras import MAIN
from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M, MACHINE_POS_W
from lerobot_excav.envs.tasks.scoop.visibility import seen_area_px

PATCH_SIZE_M = 0.8
"""Edge of the square patch on the ground plane [m] (design: about 0.8 m x 0.8 m)."""

# Feasibility of a dig region (kind: tuned on train scenes, with the scripted operator).
RADIUS_RANGE_M = (3.5, 5.9)
LEAST_MEAN_HEIGHT_M = 0.38
DIG_LENGTH_M = 1.4
CUT_DEPTH_M = 0.55
LEAST_DIGGABLE_M3 = 0.40

LEAST_MASK_PX = 60.0
"""Least area of a mask in a main view of 96 x 128 pixels without the machine (kind: tuned).

A level patch fills from 53 px at the far left of the pile to 114 px at its near right.
"""

_PICTURE_HEIGHT_PX = 96
_RASTER_M = 0.1


def feasible_centers_w(
    heights_m: NDArray[np.float64], x_w: NDArray[np.float64], y_w: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the centres of all feasible dig regions on a 10 cm raster of the dig area.

    The soil surface has heights (nx, ny) above the floor at cell centres (nx,) and (ny,) of one spacing [m]. The
    centres lie on it, (n, 3) [m], world frame; n may be 0.
    """
    cell_size_m = float(x_w[1] - x_w[0])
    step = max(1, round(_RASTER_M / cell_size_m))
    ix, iy = (step * index for index in np.nonzero(heights_m[::step, ::step] >= LEAST_MEAN_HEIGHT_M))
    centers_w = np.stack([x_w[ix], y_w[iy], heights_m[ix, iy]], axis=-1)
    radius = np.hypot(*(centers_w[:, :2] - MACHINE_POS_W[:2]).T)
    centers_w = centers_w[(RADIUS_RANGE_M[0] <= radius) & (radius <= RADIUS_RANGE_M[1])]
    seen_px = seen_area_px(heights_m, x_w, y_w, MAIN, picture_height_px=_PICTURE_HEIGHT_PX)
    half_patch, half_bucket = 0.5 * PATCH_SIZE_M, 0.5 * BUCKET_INNER_WIDTH_M
    patch = _cells(centers_w, x_w, y_w, (-half_patch, half_patch), half_patch)
    dig_path = _cells(centers_w, x_w, y_w, (-DIG_LENGTH_M, 0.1), half_bucket)
    cut_m = np.minimum(heights_m[dig_path], CUT_DEPTH_M).mean(axis=(1, 2))
    diggable_m3 = cut_m * BUCKET_INNER_WIDTH_M * (DIG_LENGTH_M + 0.1)
    mask_px = seen_px[patch].mean(axis=(1, 2)) * (PATCH_SIZE_M / cell_size_m) ** 2
    is_feasible = (
        (heights_m[patch].mean(axis=(1, 2)) >= LEAST_MEAN_HEIGHT_M)
        & (diggable_m3 >= LEAST_DIGGABLE_M3)
        & (mask_px >= LEAST_MASK_PX)
    )
    return np.asarray(centers_w[is_feasible])


def _cells(
    centers_w: NDArray[np.float64],
    x_w: NDArray[np.float64],
    y_w: NDArray[np.float64],
    along_range_m: tuple[float, float],
    half_width_m: float,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the nearest cells to 16 x 16 points of rectangles that point away from the machine, each (n, 16, 16).

    They reach over a range along that direction, and over a half width to both sides, from centres (n, 3).
    """
    offset = centers_w[:, :2] - MACHINE_POS_W[:2]
    forward = (offset / np.linalg.norm(offset, axis=1, keepdims=True))[:, None, None, :]
    left = np.stack([-forward[..., 1], forward[..., 0]], axis=-1)
    # Midpoints of 16 equal parts, so that a mean over them is a mean over the rectangle.
    part = (np.arange(16) + 0.5) / 16
    along = (along_range_m[0] + part * (along_range_m[1] - along_range_m[0]))[:, None, None]
    across = (half_width_m * (2.0 * part - 1.0))[:, None]
    points_w = centers_w[:, None, None, :2] + along * forward + across * left
    cell_size_m = float(x_w[1] - x_w[0])
    ix, iy = (
        np.clip(np.rint((points_w[..., axis] - axis_w[0]) / cell_size_m).astype(np.intp), 0, axis_w.size - 1)
        for axis, axis_w in enumerate((x_w, y_w))
    )
    return ix, iy
