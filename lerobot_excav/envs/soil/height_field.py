"""A height field over a rectangle: heights, deposits, samples and its own avalanches."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.relaxation import mark_around, sweep
from lerobot_excav.errors import require

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]
Grid = tuple[float, float, float, float]
"""Centre of the first cell x0, y0 and cell sizes dx, dy [m]: the form in which kernels take a grid."""


@kernel
def surface_height(heights: Array, grid: Grid, x: float, y: float) -> float:
    """Interpolate heights bilinearly between cell centres; beyond the outer centres the nearest one holds."""
    nx, ny = heights.shape
    u = min(max((x - grid[0]) / grid[2], 0.0), nx - 1.0)
    v = min(max((y - grid[1]) / grid[3], 0.0), ny - 1.0)
    i, j = min(int(u), max(nx - 2, 0)), min(int(v), max(ny - 2, 0))
    k, m = min(i + 1, nx - 1), min(j + 1, ny - 1)
    a, b = u - i, v - j
    low = heights[i, j] * (1.0 - b) + heights[i, m] * b
    high = heights[k, j] * (1.0 - b) + heights[k, m] * b
    return float(low * (1.0 - a) + high * a)


@kernel
def in_grid(heights: Array, grid: Grid, x: float, y: float) -> bool:
    """Tell whether a point lies over the field."""
    nx, ny = heights.shape
    u, v = (x - grid[0]) / grid[2] + 0.5, (y - grid[1]) / grid[3] + 0.5
    return 0.0 <= u < nx and 0.0 <= v < ny


@kernel
def _sample(heights: Array, grid: Grid, points: Array) -> Array:
    result = np.empty(len(points))
    for k in range(len(points)):
        result[k] = surface_height(heights, grid, points[k, 0], points[k, 1])
    return result


@kernel
def _tent(position: float) -> tuple[int, float, float, float, float]:
    """Return the first of four cells around a position [cells] and their weights, which sum to 1.

    A tent two cells wide on each side: about the radius of the cone that one parcel makes. Weights of cells
    beyond the border go to the cell at the border.
    """
    first = int(np.floor(position)) - 1
    f = position - np.floor(position)
    return first, 0.25 * (1.0 - f), 0.25 * (2.0 - f), 0.25 * (1.0 + f), 0.25 * f


@kernel
def _deposit(heights: Array, active: Mask, grid: Grid, points: Array, volumes: Array) -> None:
    nx, ny = heights.shape
    area = grid[2] * grid[3]
    for k in range(len(points)):
        wx = _tent((points[k, 0] - grid[0]) / grid[2])
        wy = _tent((points[k, 1] - grid[1]) / grid[3])
        for a in range(4):
            i = min(max(wx[0] + a, 0), nx - 1)
            share_x = (wx[1], wx[2], wx[3], wx[4])[a]
            for b in range(4):
                j = min(max(wy[0] + b, 0), ny - 1)
                share_y = (wy[1], wy[2], wy[3], wy[4])[b]
                heights[i, j] += volumes[k] / area * share_x * share_y
                mark_around(active, i, j)


class HeightField:
    """Soil on a rigid, level floor as one column height per cell.

    Attributes:
        heights: (nx, ny) heights above the floor [m], index along x first.
        active: (nx, ny) columns that the next avalanche sweep looks at.
        ceiling: (nx, ny) heights up to which soil can avalanche [m]: the underside of the bucket, else infinite.
        grid: Centre of the first cell and cell sizes.
    """

    def __init__(self, shape: tuple[int, int], cell_m: tuple[float, float], border_height_m: float) -> None:
        """Make an empty field centred at the origin of its plane; soil above the border height runs off it."""
        cell_m = (float(cell_m[0]), float(cell_m[1]))
        self.heights: Array = np.zeros(shape)
        self.active: Mask = np.zeros(shape, dtype=np.uint8)
        self.ceiling: Array = np.full(shape, np.inf)
        self.grid: Grid = (-0.5 * (shape[0] - 1) * cell_m[0], -0.5 * (shape[1] - 1) * cell_m[1], *cell_m)
        self._delta: Array = np.zeros(shape)
        self._border_height_m = border_height_m
        self._at_rest = True

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell [m2]."""
        return self.grid[2] * self.grid[3]

    @property
    def volume_m3(self) -> float:
        """Volume of all columns [m3]."""
        return float(self.heights.sum()) * self.cell_area_m2

    def centres(self, axis: int) -> Array:
        """Return the coordinates of the cell centres along x (0) or y (1) [m]."""
        steps = np.arange(self.heights.shape[axis], dtype=np.float64)
        return np.asarray(self.grid[axis] + steps * self.grid[2 + axis])

    def reset(self, heights_m: ArrayLike | None) -> None:
        """Replace all heights, byte for byte; zero if none are given.

        Raises:
            ConfigurationError: The shape is wrong, or a height is negative or not finite.
        """
        shape = self.heights.shape
        new = np.zeros(shape) if heights_m is None else np.asarray(heights_m, dtype=np.float64)
        require(
            new.shape == shape, f"heights_m has shape {new.shape}; allowed: {shape}, one height per cell."
        )
        require(
            bool(np.isfinite(new).all()),
            "heights_m holds values that are not finite; give metres above the floor.",
        )
        require(
            bool((new >= 0).all()),
            f"heights_m goes down to {new.min():.4g} m; allowed: 0 and above the rigid floor.",
        )
        self.heights[:] = new
        self.active[:] = 1
        self.ceiling[:] = np.inf
        self._at_rest = False

    def sample(self, points: Array) -> Array:
        """Return the bilinear height [m] at (n, 2) points of the field's plane."""
        return _sample(self.heights, self.grid, np.ascontiguousarray(points, dtype=np.float64))

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Tell which of (n, 2) points lie over the field."""
        half = 0.5 * np.array(self.heights.shape) * self.grid[2:]
        return np.asarray((np.abs(points) < half).all(axis=-1))

    def deposit(self, points: Array, volumes_m3: Array) -> None:
        """Add volumes at (n, 2) points, each spread over the 4 x 4 nearest columns."""
        _deposit(self.heights, self.active, self.grid, np.ascontiguousarray(points), volumes_m3)
        self.wake()

    def wake(self) -> None:
        """Look for avalanches again: columns were marked active from outside."""
        self._at_rest = False

    def uncover(self) -> None:
        """Remove all ceilings."""
        self.ceiling[:] = np.inf
        self.active[:] = 1
        self._at_rest = False

    def window(self, points: Array) -> tuple[int, int, int, int]:
        """Return index ranges i0, i1, j0, j1 of the columns under the bounding box of (n, 2 or 3) points."""
        nx, ny = self.heights.shape
        low, high = points.min(axis=0), points.max(axis=0)
        x0, y0, dx, dy = self.grid
        i0, i1 = int(np.ceil((low[0] - x0) / dx)), int(np.floor((high[0] - x0) / dx)) + 1
        j0, j1 = int(np.ceil((low[1] - y0) / dy)), int(np.floor((high[1] - y0) / dy)) + 1
        return min(max(i0, 0), nx), min(max(i1, 0), nx), min(max(j0, 0), ny), min(max(j1, 0), ny)

    def relax(self, sweeps: int, slope_tan: float) -> float:
        """Let soil avalanche for some sweeps; return the volume [m3] that ran off over the border."""
        lost = 0.0
        for _ in range(sweeps):
            if self._at_rest:
                break
            cell_m = (self.grid[2], self.grid[3])
            over, changed = sweep(
                self.heights, self._delta, self.active, self.ceiling, cell_m, slope_tan, self._border_height_m
            )
            lost += over
            self._at_rest = changed == 0
        return lost * self.cell_area_m2
