"""The surface of the ground in three dimensions, for people."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Relief:
    """Heights over a grid of the world.

    Attributes:
        x_w: (n,) coordinates of its lines along x [m].
        y_w: (m,) coordinates of its lines along y [m].
        height_m: (n, m) heights over the floor [m].
        rgb: (n, m, 3) uint8 colours that tell the heights.
    """

    x_w: NDArray[np.float64]
    y_w: NDArray[np.float64]
    height_m: NDArray[np.float64]
    rgb: NDArray[np.uint8]

    @property
    def vertices_w(self) -> NDArray[np.float32]:
        """All points of the grid, (n m, 3) [m], row by row."""
        x, y = np.meshgrid(self.x_w, self.y_w, indexing="ij")
        return np.stack([x, y, self.height_m], axis=-1).reshape(-1, 3).astype(np.float32)

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Two triangles a cell, (2 (n - 1) (m - 1), 3), as numbers of `vertices_w`, counter-clockwise from above."""
        number = np.arange(self.height_m.size, dtype=np.uint32).reshape(self.height_m.shape)
        corner, along_x, along_y, opposite = number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:]
        halves = [(corner, along_x, opposite), (corner, opposite, along_y)]
        return np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])
