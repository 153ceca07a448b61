"""How the time of a step grows with the number of awake parcels and with the number of cells."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.soil import cone, dig_cycle, timed_steps
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil import FIDELITIES, Soil
from validation.soil.arrangement import cylinder
from validation.soil.experiment import Conditions
from validation.soil.results import Plot, Series

Array = NDArray[np.float64]

_EXTENT_M = 6.0
_SLENDERNESS = 2.5
"""Height over radius of a column."""

_TICKS = slice(2, 16)
"""Ticks of a falling column that are timed: all parcels touch by then, and hardly any has come to rest."""

_COUNTS = (100, 250, 500, 750, 1000, 1500, 2000)
_CELLS = (40, 60, 80, 120, 160, 240)
_REPEATS = 3
"""A step computes the same every time; the quickest of several runs is the one that nothing else disturbed."""


class StepTime(NamedTuple):
    """Time of one step under one load.

    Attributes:
        size: Awake parcels, or cells along one side of the dig area.
        mean_ms: Mean computing time.
        p95_ms: 95 % of the steps take less.
    """

    size: float
    mean_ms: float
    p95_ms: float


def parcel_scaling(preset: str, fidelity: str, seed: int, *, quick: bool = False) -> list[StepTime]:
    """Time steps with more and more parcels that fall apart as a column, up to the fidelity's bound.

    Args:
        preset: Soil.
        fidelity: Numerical effort.
        seed: Seed of their arrangement.
        quick: Whether to take fewer sizes.
    """
    counts = [count for count in _COUNTS if count <= FIDELITIES[fidelity].most_awake]
    _column(preset, fidelity, seed, counts[0], 1)  # compiles or loads the kernels
    repeats = 1 if quick else _REPEATS
    return [_column(preset, fidelity, seed, count, repeats) for count in (counts[::2] if quick else counts)]


def grid_scaling(preset: str, fidelity: str, seed: int, *, quick: bool = False) -> list[StepTime]:
    """Time a dig cycle on the same dig area with more and more cells.

    Arguments are those of `parcel_scaling`.
    """
    repeats = 1 if quick else _REPEATS
    _dig(preset, fidelity, seed, _CELLS[0], 1)
    return [_dig(preset, fidelity, seed, cells, repeats) for cells in (_CELLS[::3] if quick else _CELLS)]


def scaling_plots(conditions: Conditions) -> tuple[Plot, Plot]:
    """Time both and return the plots `scaling`, with all fidelities, and `scaling_grid`, with the chosen one."""
    preset, seed, quick = conditions.preset, conditions.seeds[0], conditions.quick
    parcels = {name: parcel_scaling(preset, name, seed, quick=quick) for name in FIDELITIES}
    cells = {conditions.fidelity: grid_scaling(preset, conditions.fidelity, seed, quick=quick)}
    return (
        Plot(
            name="scaling",
            title="Step time and awake parcels, each fidelity up to its bound",
            x_label="awake parcels",
            y_label="computing time of a step [ms]",
            curves=_curves(parcels),
        ),
        Plot(
            name="scaling_grid",
            title="Mean step time of a dig cycle and size of the grid",
            x_label="cells along each side of the dig area",
            y_label="computing time of a step [ms]",
            curves=_curves(cells),
        ),
    )


def _curves(series: dict[str, list[StepTime]]) -> tuple[Series, ...]:
    return tuple(
        Series(
            label=name,
            x=tuple(time.size for time in times),
            y=tuple(time.mean_ms for time in times),
            style="line",
        )
        for name, times in series.items()
    )


def _column(preset: str, fidelity: str, seed: int, count: int, repeats: int) -> StepTime:
    soil = Soil(preset, fidelity=fidelity, seed=seed)
    bulk_m3 = count * soil.parcel_mass_kg / soil.density_kg_m3
    radius_m = (1.2 * bulk_m3 / (math.pi * _SLENDERNESS)) ** (1.0 / 3.0)
    points = cylinder(radius_m, 2.0 * _SLENDERNESS * radius_m, soil, np.random.default_rng(seed))
    lowest = points[np.argsort(points[:, 2], kind="stable")][:count]

    def run() -> tuple[Array, Array]:
        soil.reset()
        soil.add_parcels(lowest, np.zeros_like(lowest))
        times, _, awake = timed_steps(soil, [None] * _TICKS.stop)
        return times[_TICKS], awake[_TICKS]

    runs = [run() for _ in range(repeats)]
    return _summary(float(runs[0][1].mean()), [times for times, _ in runs])


def _dig(preset: str, fidelity: str, seed: int, cells: int, repeats: int) -> StepTime:
    soil = Soil(preset, cell_size_m=_EXTENT_M / cells, fidelity=fidelity, seed=seed, container=TARGET_BOX)
    runs = []
    for _ in range(repeats):
        soil.reset(cone(soil))
        runs.append(timed_steps(soil, list(dig_cycle()))[0])
    return _summary(float(cells), runs)


def _summary(size: float, runs_ms: list[Array]) -> StepTime:
    """Take the quickest run of every step."""
    times = np.min(runs_ms, axis=0)
    return StepTime(size, float(times.mean()), float(np.percentile(times, 95)))
