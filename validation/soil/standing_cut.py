"""Cuts in cohesive soil stand up to their critical height and fail beyond it."""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.soil.parameters import Strength
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table
from validation.soil.slopes import across_m, flowing

_STEP_S = 0.02
_LIMIT_S = 0.4
LOW_CUT_M = 0.2
STANDS, FAILS = 0.93, 1.1
"""Heights of a vertical cut over the critical one at which it must stand and fail (our own numbers)."""

INCLINED_STANDS, INCLINED_FAILS = 0.7, 1.2
"""The same of an inclined face, which is a staircase of columns: the steps are steeper than the face."""


def critical_height_m(strength: Strength, face_deg: float) -> float:
    """Return the height [m] of a face at which it fails (Culmann): 4 c / gamma sin i cos phi / (1 - cos(i - phi))."""
    i, phi = math.radians(face_deg), math.atan(strength.slope_tan)
    return 4.0 * strength.cohesion_m * math.sin(i) * math.cos(phi) / (1.0 - math.cos(i - phi))


class Case(NamedTuple):
    """A face in some soil."""

    soil: str
    strength: Strength
    face_deg: float
    azimuth_deg: float
    cell_m: float


WEAK = Strength(PRESETS["dirt"].slope_tan, 0.04, 1.1)
CASES = (
    *(Case(name, PRESETS[name].strength, 90.0, *where) for name in ("dirt", "wet_sand") for where in ((0.0, 0.1),)),
    *(Case(name, PRESETS[name].strength, 90.0, *where) for name in ("dirt", "wet_sand") for where in ((22.5, 0.05),)),
    *(Case("dirt", PRESETS["dirt"].strength, 90.0, *where) for where in ((33.0, 0.1), (57.0, 0.05), (190.0, 0.05))),
    *(Case("weak", WEAK, 60.0, *where) for where in ((0.0, 0.05), (22.5, 0.05), (33.0, 0.1))),
    *(Case("weak", WEAK, 75.0, *where) for where in ((0.0, 0.05), (22.5, 0.04))),
)
QUICK_CASES = CASES[0], CASES[2], CASES[7]


def motion_m(case: Case, height_m: float) -> tuple[float, float]:
    """Return the greatest change of a column [m] after a cut was made, and the error of the mass, as a share of it."""
    count = 2 * math.ceil((1.2 * height_m + 1.0) / case.cell_m)
    across = across_m((count, count), case.cell_m, case.azimuth_deg)
    if case.face_deg == 90.0:
        start = np.where(across < 0.0, height_m, 0.0)
    else:
        start = np.clip(0.5 * height_m - across * math.tan(math.radians(case.face_deg)), 0.0, height_m)
    *_, field = flowing(start, case.cell_m, case.strength, _STEP_S, _LIMIT_S)
    solid_m3 = start.sum() * case.cell_m**2
    return float(np.abs(field.heights - start).max()), field.solid_m3(case.strength.swell) / solid_m3 - 1.0


@experiment(
    name="standing_cut",
    title="Cuts that stand",
    source="Culmann's critical height of a face at the angle i: 4 c/γ sin i cos φ / (1 − cos(i − φ)); at 90° "
    "4 c/γ tan(45° + φ/2)",
    measures="Faces of different height, slope and azimuth in cohesive soil, on cells of three sizes; the greatest "
    "change of a column in 0.4 s.",
    gate="vertical: stands at 0.93 and fails at 1.1 times the critical height; inclined: at 0.7 and 1.2 times; a "
    "cut of 0.2 m stands; mass kept to 1e-12",
)
def run(conditions: Conditions) -> Result:
    """Make cuts below and above the critical height."""
    checks, rows, errors = [], [], []
    for case in track(QUICK_CASES if conditions.quick else CASES, "cuts"):
        critical_m = critical_height_m(case.strength, case.face_deg)
        stands, fails = (STANDS, FAILS) if case.face_deg == 90.0 else (INCLINED_STANDS, INCLINED_FAILS)
        low, low_error = motion_m(case, stands * critical_m)
        high, high_error = motion_m(case, fails * critical_m)
        errors += [low_error, high_error]
        label = f"{case.soil}, {case.face_deg:.0f}° facing {case.azimuth_deg}°, cells of {case.cell_m} m"
        checks += [
            Check(f"motion at {stands} times the critical height, {label}", low, "m", high=0.0),
            Check(f"motion at {fails} times the critical height, {label}", high, "m", low=0.1 * critical_m),
        ]
        rows.append((case.soil, case.face_deg, case.azimuth_deg, case.cell_m, critical_m, low, high))
    for name in ("dirt", "wet_sand"):
        low, _ = motion_m(Case(name, PRESETS[name].strength, 90.0, 22.5, 0.05), LOW_CUT_M)
        checks.append(Check(f"motion of a cut of {LOW_CUT_M} m, {name}", low, "m", high=0.0))
    checks.append(Check("greatest error of the mass, share of it", float(np.abs(errors).max()), high=1e-12))
    header = (
        *("soil", "face [°]", "azimuth [°]", "cell [m]", "critical height [m]", "motion below it [m]"),
        "motion above it [m]",
    )
    return Result(checks=tuple(checks), tables=(Table(header, tuple(rows)),))
