"""The force kernel on a plane blade, against formulas for cutting dry sand (measured ones: `moving_blade`)."""

import dataclasses
import math
from itertools import pairwise

import numpy as np

from lerobot_excav.envs.soil import PRESETS, SoilParameters
from lerobot_excav.envs.soil.forces import blade_force_n
from validation.soil.column_laws import power_law
from validation.soil.experiment import Conditions, experiment
from validation.soil.results import Check, Plot, Result, Series, Table

DEPTHS_M = (0.05, 0.10, 0.15)
WIDTH_M = 0.33

THEORIES_N = {
    30.0: ((23.0, 24.0, 69.0), (92.0, 117.0, 92.0), (207.0, 304.0, 207.0)),
    45.0: ((23.0, 27.0, 107.0), (92.0, 130.0, 169.0), (207.0, 337.0, 207.0)),
    60.0: ((28.0, 36.0, 168.0), (113.0, 171.0, 279.0), (254.0, 444.0, 333.0)),
    75.0: ((43.0, 55.0, 289.0), (172.0, 270.0, 493.0), (387.0, 716.0, 610.0)),
    90.0: ((92.0, 119.0, 643.0), (367.0, 611.0, 1102.0), (827.0, 1673.0, 1378.0)),
}
"""Total force [N] by rake [deg] and depth: earthmoving equation, with side crescents (McKyes and Ali 1977), wedge with
the layer of soil that rides on the blade. They bracket what was measured, which is published in figures only."""

LOW, HIGH = 0.8, 1.25
"""Gate of a cell: from 0.8 times the least to 1.25 times the greatest theory."""

SWEEP_DEG = tuple(float(v) for v in range(25, 91, 1))


def blade_sand() -> SoilParameters:
    """Return the sand of the experiment."""
    return dataclasses.replace(
        PRESETS["sand"],
        density_kg_m3=1460.0,
        friction_angle_rad=math.radians(38.0),
        steel_friction_angle_rad=math.radians(26.6),
    )


def total_force_n(rake_deg: float, depth_m: float) -> float:
    """Return the size of the force on the blade [N]."""
    return float(np.linalg.norm(blade_force_n(blade_sand(), depth_m, math.radians(rake_deg), WIDTH_M)))


@experiment(
    name="blade_force",
    title="Formulas for a blade",
    source="Hatamura and Chijiiwa 1977, as in Miedema, The Delft Sand, Clay and Rock Cutting Model, ch. 11 (their "
    "measured forces are in figures; the gate is the bracket of three theories for their sand and blade: it is a "
    "formula, and no validation)",
    measures="A blade 0.33 m wide at a rake of 30° to 90°, 0.05 m to 0.15 m deep, in level sand of 38°, 26.6° on steel "
    "and 1460 kg/m³.",
    gate="in every cell from 0.8 times the least to 1.25 times the greatest theory; growing with depth, exponent "
    "1.6 to 2.1; least near a rake of 35° to 45°",
)
def run(_: Conditions) -> Result:
    """Push the blade at every rake and depth; the conditions play no part."""
    forces = {rake: [total_force_n(rake, d) for d in DEPTHS_M] for rake in THEORIES_N}
    checks = [
        Check(f"force at {rake:.0f}°, {depth} m", force, "N", low=low, high=high)
        for rake in THEORIES_N
        for depth, force, (low, high) in zip(DEPTHS_M, forces[rake], _gates(rake), strict=True)
    ]
    exponents = [power_law(DEPTHS_M, forces[rake])[1] for rake in THEORIES_N]
    growth = min(b / a for row in forces.values() for a, b in pairwise(row))
    least_deg = min(SWEEP_DEG, key=lambda rake: total_force_n(rake, 0.10))
    checks += [
        Check("least growth from depth to depth", growth, low=1.0),
        Check("least exponent of the depth", min(exponents), low=1.6, high=2.1),
        Check("greatest exponent of the depth", max(exponents), low=1.6, high=2.1),
        Check("rake of the least force", least_deg, "°", low=35.0, high=45.0),
    ]
    return Result(checks=tuple(checks), tables=(_table(forces),), plots=(_plot(forces),))


def _gates(rake: float) -> list[tuple[float, float]]:
    """Return the gate [N] at each depth."""
    return [(LOW * min(theories), HIGH * max(theories)) for theories in THEORIES_N[rake]]


def _table(forces: dict[float, list[float]]) -> Table:
    rows = []
    for rake, row in forces.items():
        cells: list[float | str] = [rake]
        for force, theories in zip(row, THEORIES_N[rake], strict=True):
            cells += [force, " / ".join(f"{value:.0f}" for value in theories)]
        rows.append(tuple(cells))
    header = [text for depth in DEPTHS_M for text in (f"{depth} m [N]", "three theories [N]")]
    return Table(("rake [°]", *header), tuple(rows))


def _plot(forces: dict[float, list[float]]) -> Plot:
    rakes, curves = list(THEORIES_N), []
    for k, depth in enumerate(DEPTHS_M):
        low, high = zip(*(_gates(rake)[k] for rake in rakes), strict=True)
        found = [forces[rake][k] for rake in rakes]
        curves.append(Series(f"gate, {depth} m", rakes, low, y_high=high, color=k))
        curves.append(Series(f"this soil, {depth} m", rakes, found, color=k))
    return Plot("blade_force", "Force on a blade 0.33 m wide", "rake [°]", "force [N]", tuple(curves))
