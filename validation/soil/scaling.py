"""How the time of a step grows with the number of awake parcels and with the number of cells."""

import math
from collections.abc import Callable, Sequence
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
        quick: Whether to take fewer sizes, once each.
    """
    counts = [count for count in _COUNTS if count <= FIDELITIES[fidelity].most_awake]

    def fall(count: int) -> tuple[Array, float]:
        soil = Soil(preset, fidelity=fidelity, seed=seed)
        bulk_m3 = count * soil.parcel_mass_kg / soil.density_kg_m3
        radius_m = (1.2 * bulk_m3 / (math.pi * _SLENDERNESS)) ** (1.0 / 3.0)
        points = cylinder(radius_m, 2.0 * _SLENDERNESS * radius_m, soil, np.random.default_rng(seed))
        lowest = points[np.argsort(points[:, 2], kind="stable")][:count]
        soil.add_parcels(lowest, np.zeros_like(lowest))
        times, _, awake = timed_steps(soil, [None] * _TICKS.stop)
        return times[_TICKS], float(awake[_TICKS].mean())

    return _quickest(fall, counts[::2] if quick else counts, 1 if quick else _REPEATS)


def grid_scaling(preset: str, fidelity: str, seed: int, *, quick: bool = False) -> list[StepTime]:
    """Time a dig cycle on the same dig area with more and more cells; arguments as in `parcel_scaling`."""

    def dig(cells: int) -> tuple[Array, float]:
        size_m = _EXTENT_M / cells
        soil = Soil(preset, cell_size_m=size_m, fidelity=fidelity, seed=seed, container=TARGET_BOX)
        soil.reset(cone(soil))
        return timed_steps(soil, list(dig_cycle()))[0], float(cells)

    return _quickest(dig, _CELLS[::3] if quick else _CELLS, 1 if quick else _REPEATS)


def _quickest(run: Callable[[int], tuple[Array, float]], sizes: Sequence[int], repeats: int) -> list[StepTime]:
    """Run every size some times and take the quickest run of every step."""
    run(sizes[0])  # compiles or loads the kernels
    found = []
    for size in sizes:
        runs = [run(size) for _ in range(repeats)]
        times = np.min([times for times, _ in runs], axis=0)
        found.append(StepTime(runs[0][1], float(times.mean()), float(np.percentile(times, 95))))
    return found


def scaling_plots(conditions: Conditions) -> tuple[Plot, Plot]:
    """Time both and return the plots `scaling`, with all fidelities, and `scaling_grid`, with the chosen one."""
    preset, seed, quick = conditions.preset, conditions.seeds[0], conditions.quick
    parcels = {name: parcel_scaling(preset, name, seed, quick=quick) for name in FIDELITIES}
    cells = {conditions.fidelity: grid_scaling(preset, conditions.fidelity, seed, quick=quick)}
    title, y_label = ("Step time and awake parcels, each fidelity up to its bound", "computing time of a step [ms]")
    across = "cells along each side of the dig area"
    return (
        Plot("scaling", title, "awake parcels", y_label, _curves(parcels)),
        Plot("scaling_grid", "Mean step time of a dig cycle and size of the grid", across, y_label, _curves(cells)),
    )


def _curves(series: dict[str, list[StepTime]]) -> tuple[Series, ...]:
    return tuple(
        Series(name, [time.size for time in times], [time.mean_ms for time in times], style="line")
        for name, times in series.items()
    )
