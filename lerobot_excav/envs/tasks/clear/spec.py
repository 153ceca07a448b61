"""Clear-v0 as data."""

from dataclasses import replace

from lerobot_excav.envs.tasks.scoop.spec import SCOOP

CYCLES = 16
"""Cycles of an episode at most (kind: guess; ten of 435 kg are less than 84 % of a pile of 5.4 t)."""

CYCLE_LIMIT_S = 25.0
"""Time after which a cycle is given up [s]; late ones of a scripted operator take up to 20 s (kind: tuned)."""

LEAST_REMOVED = 0.75
"""Part of the pile that has to be removed for success (kind: design)."""

CLEAR = replace(
    SCOOP,
    id="Clear-v0",
    description="Dig the pile away, cycle by cycle where the mask points, and dump it in the box.",
    duration_s=CYCLES * CYCLE_LIMIT_S,
    env_entry="lerobot_excav.envs.tasks.clear.env:ClearEnv",
    operator_entry="lerobot_excav.envs.tasks.clear.repeating:RepeatingOperator",
    measures_entry="lerobot_excav.envs.tasks.clear.measures:CLEAR_MEASURES",
    judges_at_the_end=True,
    default_target=0,
)
