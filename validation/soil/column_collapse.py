"""T1: an axisymmetric column of dry grains is released and spreads.

The run-out (r - r0) / r0 grows like the aspect ratio a = h0 / r0 for low columns and like its square root for tall
ones. A height field that only relaxes to its repose angle has no inertia: it ends as the cone of the same volume,
(3 a / tan phi)^(1/3) - 1, whatever fell how far.
"""

from collections.abc import Callable

import numpy as np

from validation.soil import column_laws as laws
from validation.soil.column import Collapse, collapse, sand_with_friction
from validation.soil.experiment import Conditions, SoilExperiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

FRICTIONS_DEG = (39.0, 30.0)
LOW_ASPECTS = (0.5, 0.75, 1.0, 1.5)
TALL_ASPECTS = (2.0, 2.5, 3.0, 4.0)
QUICK_LOW_ASPECTS = (0.5, 1.0, 1.5)
QUICK_TALL_ASPECTS = (2.0, 4.0)

PREFACTOR_LOW = {39.0: 0.5, 30.0: 0.9}
"""Lower end of the gate of the prefactor, by friction angle [deg]."""

CONE_MARGIN = 1.1
"""How much farther than the height field alone the soil has to run (our own number; the reference only asks that the
cone be told apart)."""

Found = dict[float, list[list[Collapse]]]
"""Repeated collapses, by friction angle and in the order of the aspect ratios."""


def run(conditions: Conditions) -> Result:
    """Release columns of sand with two friction angles."""
    low = QUICK_LOW_ASPECTS if conditions.quick else LOW_ASPECTS
    tall = QUICK_TALL_ASPECTS if conditions.quick else TALL_ASPECTS
    seeds = conditions.seeds[:1] if conditions.quick else conditions.seeds
    found: Found = {}
    for phi, aspect in track([(p, a) for p in FRICTIONS_DEG for a in (*low, *tall)], "T1 columns"):
        sand = sand_with_friction(phi)
        runs = [collapse(sand, aspect, fidelity=conditions.fidelity, seed=seed) for seed in seeds]
        found.setdefault(phi, []).append(runs)
    counts = [one.parcel_count for groups in found.values() for runs in groups for one in runs]
    return Result(
        checks=tuple(check for phi in FRICTIONS_DEG for check in _checks(phi, found[phi], len(low))),
        tables=(_table(found), _fit_table(found, len(low))),
        plots=_plots(found),
        remarks=(f"{min(counts)} to {max(counts)} parcels per column, {len(seeds)} arrangement(s) of each.",),
    )


def _mean(runs: list[Collapse], name: str) -> float:
    return float(np.mean([getattr(one, name) for one in runs]))


def _fit(groups: list[list[Collapse]]) -> tuple[float, float]:
    return laws.power_law([_mean(g, "aspect") for g in groups], [_mean(g, "run_out") for g in groups])


def _checks(phi: float, groups: list[list[Collapse]], low: int) -> list[Check]:
    """Return the gates of one friction angle; the first `low` groups are low columns."""
    prefactor, low_exponent = _fit(groups[:low])
    tall_prefactor, tall_exponent = _fit(groups[low:])
    least = PREFACTOR_LOW[phi]
    at_one = min(groups, key=lambda runs: abs(_mean(runs, "aspect") - 1.0))
    farther = _mean(at_one, "run_out") / _mean(at_one, "cone_run_out")
    return [
        Check(f"exponent, a ≤ 1.5, {phi:.0f}°", low_exponent, low=0.75, high=1.25),
        Check(f"exponent, a ≥ 2, {phi:.0f}°", tall_exponent, low=0.3, high=0.7),
        Check(f"prefactor, a ≤ 1.5, {phi:.0f}°", prefactor, low=least, high=1.6),
        Check(f"prefactor, a ≥ 2, {phi:.0f}°", tall_prefactor, low=least, high=1.6),
        Check(f"run-out over that of the height field alone, a = 1, {phi:.0f}°", farther, low=CONE_MARGIN),
    ]


def _table(found: Found) -> Table:
    header = (
        *("φ [°]", "a", "run-out", "spread of seeds", "Lube", "Lajeunesse", "height field alone"),
        *("h / r₀", "h / r₀ Lube", "h / r₀ Lajeunesse", "stop time / √(h₀/g)"),
    )
    rows = []
    for phi, groups in found.items():
        for runs in groups:
            a = _mean(runs, "aspect")
            spread = float(np.ptp([one.run_out for one in runs]))
            run_outs = (_mean(runs, "run_out"), spread, laws.lube_run_out(a), laws.lajeunesse_run_out(a))
            heights = (_mean(runs, "height"), laws.lube_height(a), laws.lajeunesse_height(a))
            rows.append((phi, a, *run_outs, _mean(runs, "cone_run_out"), *heights, _mean(runs, "stop_time")))
    return Table(header, tuple(rows))


def _fit_table(found: Found, low: int) -> Table:
    ours = tuple((f"this soil, {phi:.0f}°", *_fit(groups[:low]), *_fit(groups[low:])) for phi, groups in found.items())
    published = (("Lube et al. 2004", *laws.LUBE_FIT), ("Lajeunesse et al. 2004", *laws.LAJEUNESSE_FIT))
    header = ("", "prefactor, low", "exponent, low", "prefactor, tall", "exponent, tall")
    return Table(header, (*ours, *published))


def _plots(found: Found) -> tuple[Plot, Plot]:
    aspects = [float(a) for a in np.geomspace(0.4, 4.5, 80)]
    run_out = _published(aspects, laws.lube_run_out, laws.lajeunesse_run_out)
    height = _published(aspects, laws.lube_height, laws.lajeunesse_height)
    for k, (phi, groups) in enumerate(found.items(), 2):
        runs = [one for group in groups for one in group]
        run_out.append(_points(f"this soil, {phi:.0f}°", runs, "run_out", k))
        cone = [laws.cone_run_out(a, phi) for a in aspects]
        run_out.append(Series(f"height field alone: cone, {phi:.0f}°", aspects, cone, style="dashed", color=k))
        height.append(_points(f"this soil, {phi:.0f}°", runs, "height", k))
    return (
        _plot("column_run_out", "Collapse of a column: run-out", "(r − r₀) / r₀", run_out),
        _plot("column_height", "Collapse of a column: final height", "h / r₀", height),
    )


def _published(aspects: list[float], *laws: Callable[[float], float]) -> list[Series]:
    return [
        Series(label, aspects, [law(a) for a in aspects], style="line", color=color)
        for color, (label, law) in enumerate(zip(("Lube 2004", "Lajeunesse 2004"), laws, strict=True))
    ]


def _points(label: str, runs: list[Collapse], name: str, color: int) -> Series:
    return Series(
        label, tuple(one.aspect for one in runs), tuple(float(getattr(one, name)) for one in runs), color=color
    )


def _plot(name: str, title: str, y_label: str, curves: list[Series]) -> Plot:
    return Plot(name, title, "aspect ratio a = h₀ / r₀", y_label, tuple(curves), logarithmic=True)


EXPERIMENT = SoilExperiment(
    code="T1",
    title="Collapse of a column",
    source="Lube et al. 2004, J. Fluid Mech. 508:175; Lajeunesse et al. 2004, Phys. Fluids 16:2371",
    measures="Parcels fill a cylinder on an empty floor and are let go. The run-out is that of the radius that holds "
    "99 % of the mass once all of it lies in the grid. Sand at 39°, and the same sand at 30°.",
    gate="exponent 1 ± 0.25 for a ≤ 1.5 and 0.5 ± 0.2 for a ≥ 2; prefactor 0.5 to 1.6 at 39° and 0.9 to 1.6 at 30°; "
    "a height field without inertia must be told apart",
    run=run,
)
