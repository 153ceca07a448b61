"""A height field over a rectangle: heights, deposits, samples and its own avalanches."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.soil.arrays import Array, Bools, Flags
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.layer import Ground, Layer, Window, mark_around
from lerobot_excav.envs.soil.parameters import Strength
from lerobot_excav.errors import require


class Grid(NamedTuple):
    """Where the columns of a height field stand in its plane."""

    x0: float  # centre of the first cell along x [m]
    y0: float  # the same along y [m]
    dx: float  # cell size along x [m]
    dy: float  # the same along y [m]

    @classmethod
    def centred(cls, shape: tuple[int, int], dx: float, dy: float) -> "Grid":
        """Return a grid of so many cells about the origin."""
        return cls(-0.5 * (shape[0] - 1) * dx, -0.5 * (shape[1] - 1) * dy, dx, dy)

    @property
    def first_m(self) -> tuple[float, float]:
        """Centre of the first cell [m]."""
        return self.x0, self.y0

    @property
    def cell_m(self) -> tuple[float, float]:
        """Cell sizes [m]."""
        return self.dx, self.dy


@kernel
def surface_height(heights: Array, grid: Grid, x: float, y: float) -> float:
    """Interpolate heights bilinearly between cell centres; beyond the outer centres the nearest one holds."""
    nx, ny = heights.shape
    u = min(max((x - grid.x0) / grid.dx, 0.0), nx - 1.0)
    v = min(max((y - grid.y0) / grid.dy, 0.0), ny - 1.0)
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
    u, v = (x - grid.x0) / grid.dx + 0.5, (y - grid.y0) / grid.dy + 0.5
    return 0.0 <= u < nx and 0.0 <= v < ny


@kernel
def _sample(heights: Array, grid: Grid, points: Array) -> Array:
    result = np.empty(len(points))
    for k in range(len(points)):
        result[k] = surface_height(heights, grid, points[k, 0], points[k, 1])
    return result


@kernel
def _tent(position: float) -> tuple[int, tuple[float, float, float, float]]:
    """Return the first of four cells around a position [cells] and their weights, which sum to 1.

    A tent two cells wide on each side: about the radius of the cone that one parcel makes. Weights of cells
    beyond the border go to the cell at the border.
    """
    first = int(np.floor(position)) - 1
    f = position - np.floor(position)
    return first, (0.25 * (1.0 - f), 0.25 * (2.0 - f), 0.25 * (1.0 + f), 0.25 * f)


@kernel
def _deposit(heights: Array, active: Flags, grid: Grid, points: Array, volumes: Array) -> None:
    nx, ny = heights.shape
    area = grid.dx * grid.dy
    for k in range(len(points)):
        first_i, shares_x = _tent((points[k, 0] - grid.x0) / grid.dx)
        first_j, shares_y = _tent((points[k, 1] - grid.y0) / grid.dy)
        for a in range(4):
            i = min(max(first_i + a, 0), nx - 1)
            for b in range(4):
                j = min(max(first_j + b, 0), ny - 1)
                heights[i, j] += volumes[k] / area * shares_x[a] * shares_y[b]
                mark_around(active, i, j)


class HeightField:
    """Soil on a rigid, level floor as one column height per cell.

    Attributes:
        heights: (nx, ny) heights above the floor [m], index along x first.
        layer: The state of its avalanches; its arrays `heights`, `active` and `ceiling` are those of the field.
        active: (nx, ny) columns that the next avalanche step looks at.
        ceiling: (nx, ny) heights up to which soil can avalanche [m]: the underside of the bucket, else infinite.
        grid: Centre of the first cell and cell sizes.
    """

    def __init__(self, shape: tuple[int, int], cell_m: tuple[float, float], border_height_m: float) -> None:
        """Make an empty field centred at the origin of its plane; soil above the border height runs off it."""
        self.layer = Layer.empty(shape)
        self.heights: Array = self.layer.heights
        self.active: Flags = self.layer.active
        self.ceiling: Array = self.layer.ceiling
        self.grid = Grid.centred(shape, float(cell_m[0]), float(cell_m[1]))
        self._border_height_m = border_height_m
        self._at_rest = True

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell [m2]."""
        return self.grid.dx * self.grid.dy

    @property
    def volume_m3(self) -> float:
        """Volume of all columns [m3]."""
        return float(self.heights.sum()) * self.cell_area_m2

    def centres(self, axis: int) -> Array:
        """Return the coordinates of the cell centres along x (0) or y (1) [m]."""
        steps = np.arange(self.heights.shape[axis], dtype=np.float64)
        return np.asarray(self.grid.first_m[axis] + steps * self.grid.cell_m[axis])

    def reset(self, heights_m: ArrayLike | None, firm_heights_m: ArrayLike | None = None) -> None:
        """Replace all heights, byte for byte; zero if none are given.

        What lies above `firm_heights_m` has been loosened before; by default nothing has.

        Raises:
            ConfigurationError: A shape is wrong, or a height is negative or not finite.
        """
        new = np.zeros(self.heights.shape) if heights_m is None else self._checked("heights_m", heights_m)
        firm = new if firm_heights_m is None else self._checked("firm_heights_m", firm_heights_m)
        self.heights[:] = new
        self.layer.bed[:] = new
        self.layer.firm[:] = np.minimum(firm, new)
        self.layer.speeds[:] = 0.0
        self.layer.flux[:] = 0.0
        self.layer.crept_s[:] = 0.0
        self.active[:] = 1
        self.ceiling[:] = np.inf
        self._at_rest = False

    def _checked(self, name: str, heights_m: ArrayLike) -> Array:
        """Return heights (nx, ny) [m] as an array, after checking them."""
        shape, new = self.heights.shape, np.asarray(heights_m, dtype=np.float64)
        require(new.shape == shape, f"{name} has shape {new.shape}; allowed: {shape}, one height per cell.")
        require(bool(np.isfinite(new).all()), f"{name} holds values that are not finite; give metres above the floor.")
        require(bool((new >= 0).all()), f"{name} goes down to {new.min():.4g} m; allowed: 0 and above the rigid floor.")
        return new

    def sample(self, points: Array) -> Array:
        """Return the bilinear height [m] at (n, 2) points of the field's plane."""
        return _sample(self.heights, self.grid, np.ascontiguousarray(points, dtype=np.float64))

    def contains(self, points: Array) -> Bools:
        """Tell which of (n, 2) points lie over the field."""
        half = 0.5 * np.array(self.heights.shape) * self.grid.cell_m
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

    def window(self, points: Array, margin_m: tuple[float, float] = (0.0, 0.0)) -> Window:
        """Return the columns under the bounding box of (n, 2 or 3) points, widened along x and y."""
        nx, ny = self.heights.shape
        x0, y0, dx, dy = self.grid
        # Numbers of Python: on so few points, each call of NumPy costs more than all of this.
        xs, ys = points[:, :2].T.tolist()
        i0, i1 = math.ceil((min(xs) - margin_m[0] - x0) / dx), math.floor((max(xs) + margin_m[0] - x0) / dx) + 1
        j0, j1 = math.ceil((min(ys) - margin_m[1] - y0) / dy), math.floor((max(ys) + margin_m[1] - y0) / dy) + 1
        return Window(min(max(i0, 0), nx), min(max(i1, 0), nx), min(max(j0, 0), ny), min(max(j1, 0), ny))

    def solid_m3(self, swell: float) -> float:
        """Return the volume [m3] of all columns as it was in the ground, before any of it was loosened."""
        firm = float(self.layer.firm.sum())
        return (firm + (float(self.heights.sum()) - firm) / swell) * self.cell_area_m2

    def flow(self, dt_s: float, strength: Strength) -> float:
        """Let soil avalanche for some time; return the volume [m3], as in the ground, that ran off over the border."""
        if self._at_rest:
            return 0.0
        ground = Ground(*strength, self.grid.dx, self.grid.dy, self._border_height_m)
        lost, moves = flow(self.layer, ground, dt_s)
        self._at_rest = not moves
        return lost / strength.swell * self.cell_area_m2
