"""How long a step of 0.02 s takes on one core of this machine."""

import os
import platform
from functools import partial

import numpy as np

from bench.soil import StepTimes, dig_cycle, pile, quickest_steps, timed_steps
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import Soil
from validation import Array
from validation.soil.experiment import Conditions, experiment
from validation.soil.results import Check, Plot, Result, Series, Table
from validation.soil.scaling import add_column, scaling_plots

CARRY_TICKS = slice(350, 500)
"""The bucket is lifted and swung to the box."""

MANY_PARCELS = 1000
"""Load of the gate of a single step."""

RUNS = 3

_FALL_TICKS = 12
"""A column of parcels falls apart: all of them touch, and few have become ground yet."""


@experiment(
    name="speed",
    title="Speed",
    source="Needs of training and of a person at the controls",
    measures="Wall time of every step of a dig cycle, of a falling column of 1000 parcels, and of columns and grids of "
    "growing size (the quickest of three runs of each step).",
    gate="10 × real time on average and 95 % of the steps below 10 ms over a cycle; half of the steps below 1 ms while "
    "carrying; 95 % below 10 ms with 1000 awake parcels. Times depend on the machine: they decide no exit code.",
    is_timed=True,
    reasons={
        "real time over the mean step": "From the first cut to the end of the curl all parcels in the bucket move, and "
        "their sub-steps take most of the time.",
        "half of the steps while carrying": "The swing of this cycle accelerates enough to wake the load several "
        "times, and while it sleeps its parcels are still carried along one by one.",
    },
)
def run(conditions: Conditions) -> Result:
    """Time a dig cycle and the first moments of a falling column."""
    preset, fidelity, seed = conditions.preset, conditions.fidelity, conditions.seeds[0]
    tools, make_pile = list(dig_cycle()), partial(pile, preset, fidelity, seed)

    def column() -> Soil:
        return add_column(Soil(preset, (6.0, 6.0), 0.05, fidelity, seed), MANY_PARCELS, 0.45, 1.3, seed)

    timed_steps(make_pile(), tools)  # compiles or loads the kernels
    cycle = quickest_steps(make_pile, tools, RUNS)
    crowd = quickest_steps(column, [None] * _FALL_TICKS, RUNS)
    crowded = f"{crowd.awake.mean():.0f} awake parcels"
    carry = cycle.ms[CARRY_TICKS]
    return Result(
        checks=(
            Check("real time over the mean step", 1e3 * TICK_S / float(cycle.ms.mean()), "×", low=10.0),
            Check("95 % of the steps of a cycle", _percentile(cycle.ms, 95), "ms", high=10.0),
            Check("half of the steps while carrying", _percentile(carry, 50), "ms", high=1.0),
            Check(f"95 % of the steps with {crowded}", _percentile(crowd.ms, 95), "ms", high=10.0),
        ),
        tables=(_table({"cycle": cycle.ms, "carrying": carry, crowded: crowd.ms}),),
        plots=(_plot(cycle), *scaling_plots(conditions)),
        remarks=(
            f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; one thread computes. A step "
            f"computes the same in every run; the quickest of {RUNS} counts, which other programs disturbed least.",
        ),
    )


def _percentile(values: Array, percent: float) -> float:
    return float(np.percentile(values, percent))


def _table(times: dict[str, Array]) -> Table:
    rows = [
        (name, float(t.mean()), _percentile(t, 50), _percentile(t, 95), float(t.max())) for name, t in times.items()
    ]
    return Table(("steps", "mean [ms]", "50 % [ms]", "95 % [ms]", "worst [ms]"), tuple(rows))


def _plot(cycle: StepTimes) -> Plot:
    seconds = TICK_S * np.arange(1, len(cycle.ms) + 1)
    curves = (
        Series("computing time of a step [ms]", seconds, cycle.ms, "line"),
        Series("awake parcels / 100", seconds, cycle.awake / 100.0, "line"),
    )
    y_label = "computing time [ms]; awake parcels / 100"
    return Plot("step_times", "Step times of a dig cycle", "time in the cycle [s]", y_label, curves)
