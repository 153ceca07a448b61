"""An axisymmetric column of dry grains is released and spreads.

The run-out (r - r0) / r0 grows like the aspect ratio a = h0 / r0 for low columns and like its square root for tall
ones. A height field that only relaxes to its repose angle has no inertia: it ends as the cone of the same volume,
(3 a / tan phi)^(1/3) - 1, whatever fell how far.
"""

import numpy as np

from validation.soil.column import Collapse, collapse, sand_with_friction
from validation.soil.column_laws import LAJEUNESSE, LUBE, cone_run_out, power_law
from validation.soil.experiment import Conditions, experiment, track
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


@experiment(
    name="column_collapse",
    title="Collapse of a column",
    source="Lube et al. 2004, J. Fluid Mech. 508:175; Lajeunesse et al. 2004, Phys. Fluids 16:2371",
    measures="Parcels fill a cylinder on an empty floor and are let go. The run-out is that of the radius that holds "
    "99 % of the mass once all of it lies in the grid. Sand at 39°, and the same sand at 30°.",
    gate="exponent 1 ± 0.25 for a ≤ 1.5 and 0.5 ± 0.2 for a ≥ 2; prefactor 0.5 to 1.6 at 39° and 0.9 to 1.6 at 30°; "
    "a height field without inertia must be told apart",
    reasons={
        "exponent, a ≤ 1.5, 30°": "A near miss. The lowest columns run out a little farther, in relation, than those "
        "of aspect ratio 1.5, so the fit is flatter. Why has not been found out."
    },
)
def run(conditions: Conditions) -> Result:
    """Release columns of sand with two friction angles."""
    low = QUICK_LOW_ASPECTS if conditions.quick else LOW_ASPECTS
    tall = QUICK_TALL_ASPECTS if conditions.quick else TALL_ASPECTS
    found: Found = {}
    for phi, aspect in track([(p, a) for p in FRICTIONS_DEG for a in (*low, *tall)], "columns"):
        sand = sand_with_friction(phi)
        runs = [collapse(sand, aspect, fidelity=conditions.fidelity, seed=seed) for seed in conditions.repeats]
        found.setdefault(phi, []).append(runs)
    repeats = len(conditions.repeats)
    counts = [one.parcel_count for groups in found.values() for runs in groups for one in runs]
    return Result(
        checks=tuple(check for phi in FRICTIONS_DEG for check in _checks(phi, found[phi], len(low))),
        tables=(_table(found), _fit_table(found, len(low))),
        plots=_plots(found),
        remarks=(f"{min(counts):.0f} to {max(counts):.0f} parcels per column, {repeats} arrangement(s) of each.",),
    )


def _mean(runs: list[Collapse]) -> Collapse:
    return Collapse(*(float(value) for value in np.mean(runs, axis=0)))


def _fits(groups: list[list[Collapse]], low: int) -> tuple[float, ...]:
    """Return prefactor and exponent of the first `low` groups, which are low columns, and those of the others."""
    parts = ([_mean(runs) for runs in part] for part in (groups[:low], groups[low:]))
    fits = [power_law([one.aspect for one in part], [one.run_out for one in part]) for part in parts]
    return (*fits[0], *fits[1])


def _checks(phi: float, groups: list[list[Collapse]], low: int) -> list[Check]:
    """Return the gates of one friction angle."""
    prefactor, low_exponent, tall_prefactor, tall_exponent = _fits(groups, low)
    least = PREFACTOR_LOW[phi]
    at_one = min(map(_mean, groups), key=lambda one: abs(one.aspect - 1.0))
    farther = at_one.run_out / at_one.cone_run_out
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
            a, run_out, height, stop_time, _, cone, _ = _mean(runs)
            spread = float(np.ptp([one.run_out for one in runs]))
            run_outs = (run_out, spread, LUBE.run_out(a), LAJEUNESSE.run_out(a), cone)
            rows.append((phi, a, *run_outs, height, LUBE.height(a), LAJEUNESSE.height(a), stop_time))
    return Table(header, tuple(rows))


def _fit_table(found: Found, low: int) -> Table:
    ours = ((f"this soil, {phi:.0f}°", *_fits(groups, low)) for phi, groups in found.items())
    published = ((f"{law.label} et al. 2004", law.low, 1.0, law.tall, 0.5) for law in (LUBE, LAJEUNESSE))
    header = ("", "prefactor, low", "exponent, low", "prefactor, tall", "exponent, tall")
    return Table(header, (*ours, *published))


def _plots(found: Found) -> tuple[Plot, Plot]:
    aspects = [float(a) for a in np.geomspace(0.4, 4.5, 80)]
    run_out, height = [], []
    for k, law in enumerate((LUBE, LAJEUNESSE)):
        label = f"{law.label} 2004"
        run_out.append(Series(label, aspects, [law.run_out(a) for a in aspects], "line", color=k))
        height.append(Series(label, aspects, [law.height(a) for a in aspects], "line", color=k))
    for k, (phi, groups) in enumerate(found.items(), 2):
        a, run_outs, heights, *_ = zip(*(one for runs in groups for one in runs), strict=True)
        cone = [cone_run_out(aspect, phi) for aspect in aspects]
        run_out.append(Series(f"this soil, {phi:.0f}°", a, run_outs, color=k))
        run_out.append(Series(f"height field alone: cone, {phi:.0f}°", aspects, cone, "dashed", color=k))
        height.append(Series(f"this soil, {phi:.0f}°", a, heights, color=k))
    x_label, title = "aspect ratio a = h₀ / r₀", "Collapse of a column"
    return (
        Plot("column_run_out", f"{title}: run-out", x_label, "(r − r₀) / r₀", tuple(run_out), logarithmic=True),
        Plot("column_height", f"{title}: final height", x_label, "h / r₀", tuple(height), logarithmic=True),
    )
