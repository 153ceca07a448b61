"""Grains on soil that has come to rest: a landed parcel keeps its grains, and no smooth lump pops up in its place."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.soil.container import Container

# Tuned by eye.
_RADIUS_M = 0.046
_FULL_M = 0.05  # soil raised by so much is covered with grains of full size
_LEAST_SHARE = 0.15  # smaller grains are not seen
_SINK = 0.25  # of a radius, into the surface


class SettledGrains(NamedTuple):
    """Grains on the surface: one handful for every other column that has received soil."""

    positions_w: NDArray[np.float64]  # (n, 3) [m]
    radii_m: NDArray[np.float64]  # (n,)
    columns: NDArray[np.intp]  # (n,) number of the column, of which the shape is the same in every picture


def settled_grains(soil: Soil, start_heights_m: NDArray[np.float64], container: Container) -> SettledGrains:
    """Return the grains on all soil in the box, and on the soil of the dig area that lies higher than at the start."""
    ground = _on_columns(soil.heights_m - start_heights_m)
    x, y = soil.x_w[ground.i], soil.y_w[ground.j]
    ground_w = np.stack([x, y, soil.heights_m[ground.i, ground.j]], axis=-1)
    boxed = soil.container_heights_m
    if boxed is None:
        return _settled(ground_w, ground.share, ground.number)
    box = _on_columns(boxed)
    place = (2.0 * (np.stack([box.i, box.j], axis=-1) + 0.5) / boxed.shape - 1.0) * container.half_extent_m
    box_w = np.column_stack([container.center_w[:2] + place @ container.axes_w, boxed[box.i, box.j]])
    box_w[:, 2] += container.center_w[2]
    return _settled(
        np.concatenate([ground_w, box_w]),
        np.concatenate([ground.share, box.share]),
        np.concatenate([ground.number, box.number]),
    )


class _Columns(NamedTuple):
    i: NDArray[np.intp]
    j: NDArray[np.intp]
    share: NDArray[np.float64]
    number: NDArray[np.intp]


def _on_columns(raised_m: NDArray[np.float64]) -> _Columns:
    """Return the columns on which grains are seen, as on the white squares of a chessboard, and their share of size."""
    share = np.clip(raised_m / _FULL_M, 0.0, 1.0)
    i, j = np.nonzero(share > _LEAST_SHARE)
    white = (i + j) % 2 == 0
    i, j = i[white], j[white]
    return _Columns(i, j, share[i, j], i * raised_m.shape[1] + j)


def _settled(positions_w: NDArray[np.float64], share: NDArray[np.float64], columns: NDArray[np.intp]) -> SettledGrains:
    radii = _RADIUS_M * share
    return SettledGrains(positions_w - [0.0, 0.0, 1.0] * (_SINK * radii)[:, None], radii, columns)
