"""Toy task: a disc slides over a table to the spot that the mask marks."""

from lerobot_excav.envs.tasks.registry import register_task
from toy_reach.spec import REACH

register_task(REACH)
