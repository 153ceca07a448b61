"""Stages as a user lists them: whole numbers and ranges with commas between them."""

import re
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import require

_ITEM = re.compile(r"([0-9]{1,9})(?:-([0-9]{1,9}))?")

# Keeps these draws apart from those of targets and operators, whose generators have the same seed.
_STREAM = 0x57A6


def parse_stages(option: str, text: str, spec: TaskSpec) -> tuple[range, ...]:
    """Return the stages that an option lists, rising; a scene is shown at one stage of each range.

    `0,4` names two stages, and `0,1-13` stage 0 and one that is drawn for every scene from 1 to 13.

    Raises:
        ConfigurationError: An item is neither a number nor a range, one is beyond the last stage of the task, or two
            of them share a stage.
    """
    items = [_ITEM.fullmatch(word.strip()) for word in text.split(",")]
    stages = [range(int(item[1]), int(item[2] or item[1]) + 1) for item in items if item]
    require(
        len(stages) == len(items) and all(stages),
        f"{option}={text!r:.100} is not possible; give whole numbers with commas between them, such as 0,4,8, or a "
        "range to draw from, such as 0,1-13",
    )
    stages.sort(key=lambda drawn: drawn.start)
    last = max(drawn[-1] for drawn in stages)
    require(
        last == 0 or spec.last_stage > 0,
        f"{option}={text!r:.100} is not possible: scenes of {spec.id} have no stages; leave {option} out",
    )
    require(
        last <= spec.last_stage,
        f"{option}={text!r:.100} is not possible; the last stage of {spec.id} is {spec.last_stage}",
    )
    require(
        all(before[-1] < after[0] for before, after in pairwise(stages)),
        f"{option}={text!r:.100} names a stage twice; name each once",
    )
    return tuple(stages)


def stage_list(stages: Sequence[range]) -> str:
    """Return stages as text, which `parse_stages` reads."""
    return ",".join(str(drawn[0]) if len(drawn) == 1 else f"{drawn[0]}-{drawn[-1]}" for drawn in stages)


def draw_stages(stages: Sequence[range], *entropy: int) -> tuple[int, ...]:
    """Return one stage of each range, rising; the same entropy draws the same ones."""
    return tuple(int(np.random.default_rng((_STREAM, *entropy, drawn[0], drawn[-1])).choice(drawn)) for drawn in stages)
