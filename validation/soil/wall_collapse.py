"""A wall of dry sand is let go on a level floor and comes to rest in a time of gravity."""

import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil import PRESETS
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Plot, Result, Series, Table
from validation.soil.slopes import flowing

REST_M = 0.002
WATCH_S = 0.1
"""A wall rests once no column changes by 2 mm within 0.1 s."""

STOP_TIME = 3.0
"""Time to rest over the square root of height over gravity."""

TOLERANCE = 0.3
"""Part of that time (our own number)."""

_WIDTH = 3
_LIMIT_S = 20.0


class Case(NamedTuple):
    """How a wall is computed."""

    height_m: float
    cell_m: float
    step_s: float


# every pair of values occurs, not every combination
CASES = (
    *(Case(1.0, 0.1, 0.02), Case(1.0, 0.05, 0.005), Case(1.0, 0.04, 0.01)),
    *(Case(2.0, 0.1, 0.005), Case(2.0, 0.05, 0.01), Case(2.0, 0.04, 0.02)),
    *(Case(0.5, 0.1, 0.01), Case(0.5, 0.05, 0.02), Case(0.5, 0.04, 0.005)),
)
QUICK_CASES = CASES[0], CASES[3], CASES[7]


class Fall(NamedTuple):
    """What became of a wall."""

    rest_s: float  # until no column changes by 2 mm in 0.1 s
    end_s: float  # until nothing moves at all
    reach: float  # of the foot beyond the wall, where 1 % of its height lies, over the height
    steepest_deg: float
    volume_error: float  # volume at the end over that at the start, minus 1
    profile_m: Array  # (2, n) way from the wall and final height, over the height of the wall


def let_go(case: Case) -> Fall:
    """Release a wall that fills half of a channel, and watch it."""
    count = 2 * round(2.5 * case.height_m / case.cell_m)
    start: Array = np.zeros((count, _WIDTH))
    start[: count // 2] = case.height_m
    every, last, k = round(WATCH_S / case.step_s), 0.0, 0
    seen = heights = start
    for k, field in enumerate(flowing(start, case.cell_m, PRESETS["sand"].strength, case.step_s, _LIMIT_S), 1):
        heights = field.heights
        if k % every == 0:
            if np.abs(heights - seen).max() >= REST_M:
                last = k * case.step_s
            seen = heights.copy()
    x, profile = (np.arange(count) + 0.5 - count // 2) * case.cell_m, heights[:, 1]
    return Fall(
        rest_s=last,
        end_s=k * case.step_s,
        reach=float(x[profile > 0.01 * case.height_m].max()) / case.height_m,
        steepest_deg=math.degrees(math.atan(float(np.abs(np.diff(profile)).max()) / case.cell_m)),
        volume_error=float(heights.sum() / start.sum()) - 1.0,
        profile_m=np.stack([x, profile]) / case.height_m,
    )


@experiment(
    name="wall_collapse",
    title="Collapse of a wall",
    source="Stop time of collapsing columns, 2.5 to 3 √(h/g): Lube et al. 2004, J. Fluid Mech. 508:175, and Lajeunesse "
    "et al. 2004, Phys. Fluids 16:2371",
    measures="Walls of dry sand in a channel with a level floor, of three heights, on cells of three sizes, with three "
    "time steps. The fidelity has no part in it.",
    gate="at rest (less than 2 mm in 0.1 s) after 3 √(h/g) ± 30 %; not steeper than repose by more than 0.5°; volume "
    "kept to 1e-12",
)
def run(conditions: Conditions) -> Result:
    """Let walls go."""
    cases = QUICK_CASES if conditions.quick else CASES
    falls = [let_go(case) for case in track(cases, "walls")]
    checks, rows = [], []
    repose_deg = math.degrees(PRESETS["sand"].friction_angle_rad)
    for case, fall in zip(cases, falls, strict=True):
        label = f"{case.height_m} m, cells of {case.cell_m} m, {case.step_s} s per step"
        ratio = fall.rest_s / math.sqrt(case.height_m / GRAVITY_M_S2)
        low, high = (STOP_TIME * (1.0 + sign * TOLERANCE) for sign in (-1.0, 1.0))
        checks += [
            Check(f"stop time / √(h/g), {label}", ratio, low=low, high=high),
            Check(f"steepest slope, {label}", fall.steepest_deg, "°", high=repose_deg + 0.5),
            Check(f"volume error, {label}", abs(fall.volume_error), high=1e-12),
        ]
        rows.append((*case, fall.rest_s, fall.end_s, ratio, fall.reach, fall.steepest_deg))
    header = (
        *("height [m]", "cell [m]", "step [s]", "at rest after [s]", "last motion [s]", "at rest / √(h/g)"),
        *("reach / height", "steepest [°]"),
    )
    curves = [
        Series(f"{c.height_m} m, {c.cell_m} m", f.profile_m[0], f.profile_m[1], "line")
        for c, f in zip(cases, falls, strict=True)
    ]
    plot = Plot("wall_collapse", "Walls of sand at rest", "way from the wall / h", "height / h", tuple(curves))
    return Result(checks=tuple(checks), tables=(Table(header, tuple(rows)),), plots=(plot,))
