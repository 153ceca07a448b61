"""The fundamental equation of earthmoving, against tables computed apart from this code."""

import math

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.earthmoving import earthmoving_factors, failure_angle
from validation.soil.blade_force import DEPTHS_M, THEORIES_N, WIDTH_M, blade_sand
from validation.soil.experiment import Conditions, experiment
from validation.soil.results import Check, Plot, Result, Series, Table

FRICTION_DEG, STEEL_DEG = 39.0, 26.0

FACTORS = (
    (20.0, 31.0, 2.31, 1.68, 4.61, 0.38),
    (30.0, 31.4, 1.97, 1.85, 3.94, 0.55),
    (40.0, 29.7, 1.93, 2.21, 3.86, 0.75),
    (50.0, 27.0, 2.08, 2.78, 4.16, 0.99),
    (60.0, 23.7, 2.44, 3.72, 4.88, 1.31),
    (70.0, 20.0, 3.16, 5.38, 6.31, 1.73),
    (80.0, 15.9, 4.61, 8.66, 9.22, 2.36),
    (90.0, 11.7, 8.12, 16.7, 16.2, 3.45),
)
"""Rake [deg], failure angle [deg], N_gamma, N_c, N_q and N_a at 39 deg, soil on steel 26 deg."""


def blade_force_n(rake_deg: float, depth_m: float, *, density: float, width_m: float) -> float:
    """Return the force [N] of the equation on the blade of `blade_force` in dry sand of some density."""
    rake, sand = math.radians(rake_deg), blade_sand()
    friction, steel = sand.friction_angle_rad, sand.steel_friction_angle_rad
    weight = earthmoving_factors(rake, failure_angle(rake, friction, steel), friction, steel).weight
    return density * GRAVITY_M_S2 * depth_m**2 * weight * width_m


@experiment(
    name="earthmoving_factors",
    title="Factors of earthmoving",
    source="Reece 1965, McKyes 1985: the fundamental equation of earthmoving; dry sand of Hatamura and Chijiiwa 1977 "
    "(a check of the formula, and no validation)",
    measures="Factors at 39°/26° for rakes of 20° to 90°, forces on a blade 0.33 m wide in sand of 38°/26.6°, and how "
    "they scale.",
    gate="1 % of the tables; without cohesion exactly proportional to density, width and depth²",
)
def run(_: Conditions) -> Result:
    """Compare factors, forces and scaling with the tables; the conditions play no part."""
    factor_rows, factor_error = _factors()
    force_rows, force_error = _forces()
    return Result(
        checks=(
            Check("greatest error of a factor", 100.0 * factor_error, "%", high=1.0),
            Check("greatest error of a force", 100.0 * force_error, "%", high=1.0),
            Check("error of the scaling with density, width and depth²", _scaling(), high=1e-12),
        ),
        tables=(
            Table(("rake [°]", "β [°]", "N_γ", "N_c", "N_q", "N_a"), factor_rows),
            Table(("rake [°]", *(f"{d} m [N]" for d in DEPTHS_M), "tabulated [N]"), force_rows),
        ),
        plots=(_plot(factor_rows),),
        remarks=("The tabulated numbers are rounded; half of their last digit is taken off the error.",),
    )


def _error(found: float, published: float, rounding: float) -> float:
    """Return the relative error beyond the rounding of the tabulated number."""
    return max(0.0, abs(found - published) - rounding) / published


def _factors() -> tuple[tuple[tuple[float, ...], ...], float]:
    """Return the rows of the table and the greatest error."""
    friction, steel = math.radians(FRICTION_DEG), math.radians(STEEL_DEG)
    rows, worst = [], 0.0
    for rake_deg, _, *published in FACTORS:
        rake = math.radians(rake_deg)
        failure = failure_angle(rake, friction, steel)
        f = earthmoving_factors(rake, failure, friction, steel)
        found = (f.weight, f.cohesion, f.surcharge, f.inertia)
        for value, other in zip(found, published, strict=True):
            rounding = 0.05 if other >= 10.0 else 0.005
            worst = max(worst, _error(value, other, rounding))
        rows.append((rake_deg, math.degrees(failure), *found))
    return tuple(rows), worst


def _forces() -> tuple[tuple[tuple[float | str, ...], ...], float]:
    rows: list[tuple[float | str, ...]] = []
    density, worst = blade_sand().density_kg_m3, 0.0
    for rake_deg, theories in THEORIES_N.items():
        published = [plane for plane, *_ in theories]
        found = [blade_force_n(rake_deg, d, density=density, width_m=WIDTH_M) for d in DEPTHS_M]
        worst = max(worst, *(_error(a, b, 0.5) for a, b in zip(found, published, strict=True)))
        rows.append((rake_deg, *found, " / ".join(f"{value:.0f}" for value in published)))
    return tuple(rows), worst


def _scaling() -> float:
    """Return the greatest relative deviation when density, width and depth are doubled one by one."""
    once = blade_force_n(45.0, 0.1, density=1460.0, width_m=0.33)
    doubled = (
        blade_force_n(45.0, 0.1, density=2920.0, width_m=0.33) / (2.0 * once),
        blade_force_n(45.0, 0.1, density=1460.0, width_m=0.66) / (2.0 * once),
        blade_force_n(45.0, 0.2, density=1460.0, width_m=0.33) / (4.0 * once),
    )
    return max(abs(ratio - 1.0) for ratio in doubled)


def _plot(rows: tuple[tuple[float, ...], ...]) -> Plot:
    rakes, curves = [row[0] for row in FACTORS], []
    for k, name in enumerate(("N_γ", "N_c", "N_q", "N_a")):
        published, found = ([row[2 + k] for row in table] for table in (FACTORS, rows))
        curves.append(Series(name, rakes, found, style="line", color=k))
        curves.append(Series(f"{name}, tabulated", rakes, published, color=k))
    title = "Factors of the earthmoving equation, 39°"
    return Plot("earthmoving_factors", title, "rake [°]", "factor", tuple(curves))
