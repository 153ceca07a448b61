"""The same columns in this soil and in a peer that installs from PyPI."""

import math
import time
from typing import NamedTuple

import numpy as np

from validation.soil.column import MASS_SHARE, RADIUS_M, VOLUME_LIMIT_M3, Collapse, collapse, sand_with_friction
from validation.soil.column_laws import LUBE
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.newton_column import NewtonColumn, collapse_in_newton, is_installed
from validation.soil.results import Result, Table

FRICTIONS_DEG = (39.0, 30.0)
ASPECTS = (0.5, 1.0, 2.0)

NOT_INSTALLED = (
    "Newton is not installed, so nothing was compared. `uv pip install newton` beside this package, then run "
    "`python -m validation.soil --only=newton_peer`."
)


class _Pair(NamedTuple):
    """One column in both."""

    ours: Collapse
    cpu_s_per_s: float  # of ours
    newton: NewtonColumn


@experiment(
    name="newton_peer",
    title="A peer: Newton's implicit material point method",
    source="Newton 1.x, https://github.com/newton-physics/newton; law: Lube et al. 2004, J. Fluid Mech. 508:175",
    measures="The same columns of sand, one after the other in one process on one machine: radius that holds 99 % of "
    "the mass, error against the published run-out, and CPU seconds per simulated second (both warm).",
    gate="none: it is a comparison",
    is_timed=True,
)
def run(conditions: Conditions) -> Result:
    """Release columns of two friction angles in both."""
    if not is_installed():
        return Result(checks=(), remarks=(NOT_INSTALLED,))
    aspects = ASPECTS[1:2] if conditions.quick else ASPECTS
    rows = []
    for phi, aspect in track([(p, a) for p in FRICTIONS_DEG for a in aspects], "columns in both"):
        rows.append(_row(phi, _both(phi, aspect, conditions)))
    header = (
        *("φ [°]", "a", "run-out, Lube", "run-out, this soil", "run-out, Newton"),
        *("error of this soil", "error of Newton", "this soil [CPU s/s]", "Newton [CPU s/s]", "points in Newton"),
    )
    return Result(checks=(), tables=(Table(header, tuple(rows)),))


def _both(phi: float, aspect: float, conditions: Conditions) -> _Pair:
    sand, seed = sand_with_friction(phi), conditions.seeds[0]
    start = time.process_time()
    ours = collapse(sand, aspect, fidelity=conditions.fidelity, seed=seed)
    cpu_s = time.process_time() - start
    radius = min(RADIUS_M, (VOLUME_LIMIT_M3 / (math.pi * aspect)) ** (1.0 / 3.0))
    peer = collapse_in_newton(
        radius_m=radius,
        height_m=ours.aspect * radius,
        friction=sand.slope_tan,
        density_kg_m3=sand.density_kg_m3,
        share=MASS_SHARE,
        seed=seed,
    )
    return _Pair(ours, cpu_s / ours.simulated_s, peer)


def _row(phi: float, pair: _Pair) -> tuple[float, ...]:
    aspect = pair.ours.aspect
    published = LUBE.run_out(aspect)
    errors = [run_out / published - 1.0 for run_out in (pair.ours.run_out, pair.newton.run_out)]
    run_outs = (published, pair.ours.run_out, pair.newton.run_out)
    times = (pair.cpu_s_per_s, pair.newton.cpu_s_per_s)
    return (phi, aspect, *run_outs, *(float(np.round(e, 3)) for e in errors), *times, pair.newton.point_count)
