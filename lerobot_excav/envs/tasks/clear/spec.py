"""Clear-v0 as data."""

from dataclasses import replace

from lerobot_excav.envs.tasks.scoop.spec import CYCLE_LIMIT_S, SCOOP

CYCLES = 20
"""Cycles of an episode at most (kind: tuned on `val` piles with the scripted operator, before any policy was trained:
it removes 79 % of 50 piles, and 8 of them end before, as nothing is left that is worth a cycle)."""

LEAST_REMOVED = 0.75
"""Part of the pile that has to be removed for success (kind: design)."""

CLEAR = replace(
    SCOOP,
    id="Clear-v0",
    description="Dig the pile away, cycle by cycle where the mask points, and dump it in the box.",
    duration_s=CYCLES * CYCLE_LIMIT_S,
    env_entry="lerobot_excav.envs.tasks.clear.env:ClearEnv",
    measures_entry="lerobot_excav.envs.tasks.clear.measures:CLEAR_MEASURES",
    place_probe_entry=None,  # an audit looks at single scoops
    nearest_target_entry=None,  # targets are ranks of the planner's proposals
    judges_at_the_end=True,
    default_target=0,
    cuts_rest=False,
)
