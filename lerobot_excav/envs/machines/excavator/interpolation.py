"""Fields of cells, brought to other grids and smoothed, for pictures."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

_KERNEL = np.array([0.25, 0.5, 0.25])


def resampled(heights: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return values of cells, bilinear between their centres, at the vertices of a grid over the same rectangle."""
    along_x, along_y = (_weights(cells, n) for cells, n in zip(heights.shape, shape, strict=True))
    return np.asarray(along_x @ heights @ along_y.T)


def smooth(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return heights (nx, ny) averaged with those of their neighbours."""
    padded = np.pad(heights, 1, mode="edge")
    rows = sum(w * padded[k : k + heights.shape[0]] for k, w in enumerate(_KERNEL))
    return np.asarray(sum(w * rows[:, k : k + heights.shape[1]] for k, w in enumerate(_KERNEL)))


@cache
def _weights(cells: int, vertices: int) -> NDArray[np.float64]:
    """Return the weights (vertices, cells) of linear interpolation between the centres of cells that tile a line."""
    centres = (np.arange(cells) + 0.5) / cells
    points = np.linspace(0.0, 1.0, vertices)
    return np.stack([np.interp(points, centres, unit) for unit in np.eye(cells)], axis=1)
