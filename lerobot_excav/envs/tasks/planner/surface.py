"""The surface of the dig area as the main camera sees it: a map of heights, made of the depth picture alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.pinhole import PinholeCamera

CARRIER_RADIUS_M = 2.4
"""Nearer to the swing axis than this the carrier and its blade stand, and no soil is looked for [m] (kind: derived)."""

MAP_CELL_M = 0.1
"""Edge of a cell of the map [m]: a few pixels of the planner's picture each (kind: tuned)."""

HIGHEST_SOIL_M = 1.5
"""What is higher is a part of the machine [m]; piles of `train` reach 1.1 m (kind: guess)."""

STEEPEST_RISE = 1.5
STEP_M = 0.1
"""What rises over its surroundings by more than this slope and this step [m] is a part of the machine; sand rests at
0.81, and a wall of cohesive soil loses its rim to this rule (kind: guess)."""

SOIL_BAND_M = 0.12
"""How far from the height of its cell a point of the soil lies at most [m]: half a cell's diagonal along the steepest
slope, and a grain (kind: guess)."""

_RISE_CELLS = 12  # over which the slope is followed: 1.2 m, more than a bucket is long


@dataclass(frozen=True, kw_only=True)
class SeenSurface:
    """Heights of the soil as far as they are seen.

    Attributes:
        x_w: Cell centres along x [m], (nx,), world frame.
        y_w: Cell centres along y [m], (ny,).
        heights_m: Height of the soil at the cell centres (nx, ny) [m]; where it is not seen, that of the nearest cell
            that is. So soil that hides behind a ridge is neither taken for bare ground nor for a pit.
        is_seen: Whether it is seen, (nx, ny).
    """

    x_w: NDArray[np.float64]
    y_w: NDArray[np.float64]
    heights_m: NDArray[np.float64]
    is_seen: NDArray[np.bool_]

    @property
    def cell_m(self) -> float:
        """Edge of a cell [m]."""
        return float(self.x_w[1] - self.x_w[0])

    def cells_at(self, points_w: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the cells (...,) in which points (..., 2 or 3) [m] lie, those of the border for points beyond it."""
        first = np.array([self.x_w[0], self.y_w[0]])
        most = np.array(self.heights_m.shape) - 1
        cells = np.rint((np.nan_to_num(points_w[..., :2]) - first) / self.cell_m).astype(np.intp)
        cells = np.clip(cells, 0, most)
        return cells[..., 0], cells[..., 1]

    def covers(self, points_w: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points (..., 2 or 3) [m] lie in the map; NaN does not."""
        half = 0.5 * self.cell_m
        x, y = points_w[..., 0], points_w[..., 1]
        along_x = (self.x_w[0] - half <= x) & (x <= self.x_w[-1] + half)
        return np.asarray(along_x & (self.y_w[0] - half <= y) & (y <= self.y_w[-1] + half))

    def shows(self, points_w: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points (..., 3) [m] are soil that is seen, and no part of the machine above it; NaN is not."""
        cells = self.cells_at(points_w)
        away_m = np.abs(points_w[..., 2] - self.heights_m[cells])
        return np.asarray(self.covers(points_w) & self.is_seen[cells] & (away_m < SOIL_BAND_M))


def see_surface(depth_m: NDArray[np.floating], camera: PinholeCamera) -> SeenSurface:
    """Make the map of the dig area from a depth picture (H, W) [m along the optical axis] and its camera.

    Pixels that show a part of the machine are left out: what is near the swing axis or higher than any soil, then what
    rises more steeply over its surroundings than soil can.
    """
    points_w = camera.points_w(depth_m).reshape(-1, 3)
    is_soil = _is_in_dig_area(points_w) & (points_w[:, 2] < HIGHEST_SOIL_M)
    counts = tuple(round(extent / MAP_CELL_M) for extent in DIG_AREA_EXTENT_M)
    x_w, y_w = (MAP_CELL_M * (np.arange(n, dtype=np.float64) + 0.5 - 0.5 * n) for n in counts)
    means_w, is_seen = _means(points_w[is_soil], counts)
    is_seen &= ~_rises_too_steeply(np.where(is_seen, means_w[..., 2], np.inf))
    heights_m = _nearest_seen(means_w[..., 2], is_seen)
    # The mean of a cell's points lies beside its centre: go there along the slope.
    slope_x, slope_y = np.gradient(heights_m, MAP_CELL_M)
    beside_x, beside_y = x_w[:, None] - means_w[..., 0], y_w[None, :] - means_w[..., 1]
    at_centre_m = heights_m + slope_x * beside_x + slope_y * beside_y
    heights_m = np.maximum(_nearest_seen(at_centre_m, is_seen), 0.0)
    return SeenSurface(x_w=np.asarray(x_w), y_w=np.asarray(y_w), heights_m=heights_m, is_seen=is_seen)


def _is_in_dig_area(points_w: NDArray[np.float64]) -> NDArray[np.bool_]:
    half_x, half_y = 0.5 * np.asarray(DIG_AREA_EXTENT_M)
    inside = (np.abs(points_w[:, 0]) < half_x) & (np.abs(points_w[:, 1]) < half_y)
    from_machine_m = np.hypot(*(points_w[:, :2] - np.asarray(MACHINE_POS_W[:2])).T)
    return np.asarray(inside & (from_machine_m > CARRIER_RADIUS_M))


def _means(points_w: NDArray[np.float64], counts: tuple[int, ...]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the mean of the points (n, 3) in every cell, (nx, ny, 3), and whether there are any."""
    nx, ny = counts
    cells = np.floor(points_w[:, :2] / MAP_CELL_M + 0.5 * np.array(counts)).astype(np.intp)
    flat = np.ravel_multi_index((np.clip(cells[:, 0], 0, nx - 1), np.clip(cells[:, 1], 0, ny - 1)), (nx, ny))
    number = np.bincount(flat, minlength=nx * ny)
    sums = np.stack([np.bincount(flat, points_w[:, axis], nx * ny) for axis in range(3)], axis=-1)
    means_w = sums / np.maximum(number, 1)[:, None]
    return means_w.reshape(nx, ny, 3), (number > 0).reshape(nx, ny)


def _rises_too_steeply(heights_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which cells of a map, infinite where nothing is seen, rise more steeply over others than soil can."""
    diagonal = np.sqrt(2.0)
    distance = MAP_CELL_M * np.array([[diagonal, 1.0, diagonal], [1.0, 0.0, 1.0], [diagonal, 1.0, diagonal]])
    allowed = heights_m
    for _ in range(_RISE_CELLS):
        # An erosion of grey levels: the least of what every neighbour allows at its distance.
        allowed = ndimage.grey_erosion(allowed, structure=-STEEPEST_RISE * distance, mode="nearest")
    with np.errstate(invalid="ignore"):
        return np.asarray(heights_m > allowed + STEP_M)


def _nearest_seen(values: NDArray[np.float64], is_seen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return a map whose unseen cells have the value of the nearest seen one; zeros if nothing is seen."""
    if not is_seen.any():
        return np.zeros_like(values)
    nearest = ndimage.distance_transform_edt(~is_seen, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])
