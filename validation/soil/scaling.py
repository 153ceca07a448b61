"""How the time of a step grows with the number of awake parcels and with the number of cells."""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from bench.soil import dig_cycle, pile, quickest_steps
from lerobot_excav.envs.soil import FIDELITIES, Soil
from validation.soil.arrangement import cylinder
from validation.soil.experiment import Conditions
from validation.soil.results import Plot, Series

_EXTENT_M = 6.0
_SLENDERNESS = 2.5
"""Height over radius of a column."""

_TICKS = slice(2, 16)
"""Ticks of a falling column that are timed: all parcels touch by then, and hardly any has come to rest."""

_COUNTS = (100, 250, 500, 750, 1000, 1500, 2000)
_CELLS = (40, 60, 80, 120, 160, 240)
_REPEATS = 3


class StepTime(NamedTuple):
    """Mean time of a step [ms] under one load: awake parcels, or cells along one side of the dig area."""

    size: float
    mean_ms: float


def add_column(soil: Soil, count: int, radius_m: float, height_m: float, seed: int) -> Soil:
    """Add the lowest parcels of a cylinder to an empty soil, and return it: they fall apart at once."""
    points = cylinder(radius_m, height_m, soil, np.random.default_rng(seed))
    lowest = points[np.argsort(points[:, 2], kind="stable")][:count]
    soil.add_parcels(lowest, np.zeros_like(lowest))
    return soil


def parcel_scaling(fidelity: str, conditions: Conditions) -> list[StepTime]:
    """Time steps with more and more parcels that fall apart as a column, up to the fidelity's bound."""
    counts, seed = [n for n in _COUNTS if n <= FIDELITIES[fidelity].most_awake], conditions.seeds[0]

    def column(count: int) -> Soil:
        soil = Soil(conditions.preset, fidelity=fidelity, seed=seed)
        bulk_m3 = count * soil.parcel_mass_kg / soil.density_kg_m3
        radius_m = (1.2 * bulk_m3 / (math.pi * _SLENDERNESS)) ** (1.0 / 3.0)
        return add_column(soil, count, radius_m, 2.0 * _SLENDERNESS * radius_m, seed)

    found = []
    for count in counts[::2] if conditions.quick else counts:
        steps = quickest_steps(partial(column, count), [None] * _TICKS.stop, 1 if conditions.quick else _REPEATS)
        found.append(StepTime(float(steps.awake[_TICKS].mean()), float(steps.ms[_TICKS].mean())))
    return found


def grid_scaling(fidelity: str, conditions: Conditions) -> list[StepTime]:
    """Time a dig cycle on the same dig area with more and more cells."""
    preset, seed, tools = conditions.preset, conditions.seeds[0], list(dig_cycle())
    found = []
    for cells in _CELLS[::3] if conditions.quick else _CELLS:
        make = partial(pile, preset, fidelity, seed, _EXTENT_M / cells)
        steps = quickest_steps(make, tools, 1 if conditions.quick else _REPEATS)
        found.append(StepTime(float(cells), float(steps.ms.mean())))
    return found


def scaling_plots(conditions: Conditions) -> tuple[Plot, Plot]:
    """Time both and return the plots `scaling`, with all fidelities, and `scaling_grid`, with the chosen one."""
    parcels = {name: parcel_scaling(name, conditions) for name in FIDELITIES}
    cells = {conditions.fidelity: grid_scaling(conditions.fidelity, conditions)}
    y_label = "computing time of a step [ms]"
    title = "Step time and awake parcels, each fidelity up to its bound"
    title_grid, across = "Mean step time of a dig cycle and size of the grid", "cells along each side of the dig area"
    return (
        Plot("scaling", title, "awake parcels", y_label, _curves(parcels)),
        Plot("scaling_grid", title_grid, across, y_label, _curves(cells)),
    )


def _curves(series: dict[str, list[StepTime]]) -> tuple[Series, ...]:
    return tuple(Series(name, *np.transpose(times), "line") for name, times in series.items())
