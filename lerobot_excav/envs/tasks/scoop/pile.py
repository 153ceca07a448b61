"""Random piles of soil, shaped like what a truck or a loader leaves behind, at rest."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

# Where heaps are placed [m], world frame (kind: design). Wider across the machine than along its boom, so that four
# dig regions find room side by side and one behind the other.
HEAP_X_RANGE_M = (-0.55, 0.55)
HEAP_Y_RANGE_M = (-1.35, 1.35)
PILE_MASS_RANGE_KG = (4800.0, 6000.0)
BORDER_M = 0.3
"""Bare strip along the border of the dig area [m], so that no pile starts out of bounds."""

# Of the shapes that no policy of this package was trained on (kind: design): heaps apart by more than their width at
# half height, so that a saddle stays between them, and a crest of the length of a truck's tipping body.
_TWO_HEAPS_Y_M = (0.85, 1.15)
_CREST_LENGTH_M = 2.6
_CREST_HEADING_RAD = 0.35


def draw_pile(
    rng: np.random.Generator,
    *,
    pile: str = "heaps",
    x_w: NDArray[np.float64],
    y_w: NDArray[np.float64],
    repose_tan: float,
    density_kg_m3: float,
) -> NDArray[np.float64]:
    """Draw one pile at rest, as heights above the floor (nx, ny) [m].

    Args:
        rng: Source of the shape and the mass.
        pile: Its shape, one of `PILES`.
        x_w: Cell centres along x [m], shape (nx,).
        y_w: Cell centres along y [m], shape (ny,), same spacing.
        repose_tan: Steepest slope at which the soil rests.
        density_kg_m3: Bulk density [kg/m3].
    """
    from lerobot_excav.envs.soil import relax  # compiled code, which those who only name a shape need not wait for

    cell_size_m = float(x_w[1] - x_w[0])
    volume_m3 = rng.uniform(*PILE_MASS_RANGE_KG) / density_kg_m3
    shape = PILES[pile](rng, x_w, y_w, repose_tan) + _ripples(rng, x_w, y_w)
    roof = _roof(x_w, y_w, repose_tan)
    heights = _fill_to_volume(shape, roof, volume_m3 / cell_size_m**2)
    return relax(heights, cell_size_m, repose_tan)


def _heaps(
    rng: np.random.Generator, x_w: NDArray[np.float64], y_w: NDArray[np.float64], repose_tan: float
) -> NDArray[np.float64]:
    """Upper envelope of two to four cones a little flatter than repose, shape (nx, ny) [m]."""
    count = int(rng.integers(2, 5))
    # Spread across the pile rather than drawn one by one, so that no scene is a single narrow cone.
    y_heap = np.linspace(*HEAP_Y_RANGE_M, count) + rng.uniform(-0.3, 0.3, count)
    x_heap = rng.uniform(*HEAP_X_RANGE_M, count)
    peak = rng.uniform(0.75, 1.1, count)
    slope = repose_tan * rng.uniform(0.7, 0.95, count)
    distance = np.hypot(x_w[:, None, None] - x_heap, y_w[None, :, None] - y_heap)
    return np.asarray(np.max(peak - slope * distance, axis=2))


def _two_heaps(
    rng: np.random.Generator, x_w: NDArray[np.float64], y_w: NDArray[np.float64], repose_tan: float
) -> NDArray[np.float64]:
    """Upper envelope of two steep cones, one to the left and one to the right, shape (nx, ny) [m]."""
    y_heap = np.array([-1.0, 1.0]) * rng.uniform(*_TWO_HEAPS_Y_M, 2)
    x_heap = rng.uniform(*HEAP_X_RANGE_M, 2)
    peak = rng.uniform(0.9, 1.2, 2)
    distance = np.hypot(x_w[:, None, None] - x_heap, y_w[None, :, None] - y_heap)
    return np.asarray(np.max(peak - repose_tan * rng.uniform(0.85, 0.95, 2) * distance, axis=2))


def _ridge(
    rng: np.random.Generator, x_w: NDArray[np.float64], y_w: NDArray[np.float64], repose_tan: float
) -> NDArray[np.float64]:
    """One straight crest across the machine with slopes near repose, shape (nx, ny) [m]."""
    heading = 0.5 * np.pi + rng.uniform(-_CREST_HEADING_RAD, _CREST_HEADING_RAD)
    middle = np.array([rng.uniform(*HEAP_X_RANGE_M), rng.uniform(-0.2, 0.2)])
    dx, dy = x_w[:, None] - middle[0], y_w[None, :] - middle[1]
    along = np.cos(heading) * dx + np.sin(heading) * dy
    beyond = along - np.clip(along, -0.5 * _CREST_LENGTH_M, 0.5 * _CREST_LENGTH_M)
    beside = np.cos(heading) * dy - np.sin(heading) * dx
    return np.asarray(1.0 - repose_tan * rng.uniform(0.85, 0.95) * np.hypot(beyond, beside))


PILES: dict[str, Callable[..., NDArray[np.float64]]] = {"heaps": _heaps, "two_heaps": _two_heaps, "ridge": _ridge}
"""Known shapes by name. `heaps`: two to four, as in all demonstrations; the others are for tests of what was learnt."""


def _ripples(rng: np.random.Generator, x_w: NDArray[np.float64], y_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Low waves of a few centimetres, shape (nx, ny) [m]."""
    waves = np.zeros((x_w.size, y_w.size))
    for _ in range(6):
        heading, phase = rng.uniform(0.0, 2.0 * np.pi, 2)
        wave_number = 2.0 * np.pi / rng.uniform(0.5, 1.6)
        along = np.cos(heading) * x_w[:, None] + np.sin(heading) * y_w[None, :]
        waves += rng.uniform(0.004, 0.014) * np.cos(wave_number * along + phase)
    return waves


def _roof(x_w: NDArray[np.float64], y_w: NDArray[np.float64], repose_tan: float) -> NDArray[np.float64]:
    """Height above which a pile would slide off the soil grid, shape (nx, ny) [m]; zero near the border."""
    inset_x = x_w.max() - BORDER_M - np.abs(x_w)
    inset_y = y_w.max() - BORDER_M - np.abs(y_w)
    return np.asarray(np.maximum(0.0, 0.9 * repose_tan * np.minimum(inset_x[:, None], inset_y[None, :])))


def _fill_to_volume(shape: NDArray[np.float64], roof: NDArray[np.float64], column_sum_m: float) -> NDArray[np.float64]:
    """Raise or lower the shape until what stands above the floor has the wanted volume (bisection on the level)."""
    low, high = -float(shape.max()), column_sum_m
    for _ in range(80):
        level = 0.5 * (low + high)
        if np.clip(shape + level, 0.0, roof).sum() < column_sum_m:
            low = level
        else:
            high = level
    return np.clip(shape + high, 0.0, roof)
