"""Stages as a user lists them: whole numbers with commas between them."""

from collections.abc import Sequence

from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import require


def parse_stages(option: str, text: str, spec: TaskSpec) -> tuple[int, ...]:
    """Return the stages that an option lists, rising.

    Raises:
        ConfigurationError: One is not a whole number, is beyond the last stage of the task, or is named twice.
    """
    words = [word.strip() for word in text.split(",")]
    require(
        all(word.isascii() and word.isdecimal() and len(word) < 10 for word in words),
        f"{option}={text!r:.100} is not possible; give whole numbers with commas between them, such as 0,4,8",
    )
    stages = sorted(int(word) for word in words)
    require(
        stages == [0] or spec.last_stage > 0,
        f"{option}={text!r:.100} is not possible: scenes of {spec.id} have no stages; leave {option} out",
    )
    require(
        stages[-1] <= spec.last_stage,
        f"{option}={text!r:.100} is not possible; the last stage of {spec.id} is {spec.last_stage}",
    )
    require(len(set(stages)) == len(stages), f"{option}={text!r:.100} names a stage twice; name each once")
    return tuple(stages)


def stage_list(stages: Sequence[int]) -> str:
    """Return stages as text, which `parse_stages` reads."""
    return ",".join(map(str, stages))
