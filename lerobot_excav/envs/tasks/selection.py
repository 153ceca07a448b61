"""What an episode plays: scene, target and changes of the command, from options, else seed, else by chance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import ConfigurationError, require, require_choice, require_integer

RESET_OPTIONS = ("scene_id", "target_id", "stage", "commands")

Schedule = tuple[tuple[int, int], ...]
"""Changes of the command: after how many actions which target is commanded."""


class TargetAbsentError(ConfigurationError):
    """A start offers no target of this number: late stages of a scene, for instance, may have fewer."""


@dataclass(frozen=True, kw_only=True)
class Selection:
    """What an episode plays."""

    scene_id: int  # scene
    stage: int = 0  # cycles that a seeded operator has dug before the start
    target_id: int  # target that is commanded at the start
    schedule: Schedule | None = None  # changes of the command; None leaves them to the task


def select_episode(
    seed: int | None,
    options: Mapping[str, Any],
    *,
    rng: np.random.Generator,
    task: TaskSpec,
    length: int,
) -> Selection:
    """Choose scene, target and changes of the command.

    Without options the scene is the seed, or drawn if there is none, and its remainder the target, unless the task has
    a default of its own. Options may hold `scene_id`, `target_id`, `stage` (cycles dug before the start), `commands`
    (changes of the command, as pairs of the number of actions carried out before and the target, in an episode of
    `length` frames), and LeRobot's own keys, which begin with `lerobot_`.

    Raises:
        ConfigurationError: A value is not a whole number or out of range, or an option is unknown.
    """
    for key in options:
        if not str(key).startswith("lerobot_"):
            require_choice("options", key, RESET_OPTIONS)
    number = int(rng.integers(2**31)) if seed is None else seed
    scene_id = options.get("scene_id", number)
    require_integer("scene_id", scene_id, 0, 2**63 - 1)
    default = scene_id % task.target_count if task.default_target is None else task.default_target
    target_id = options.get("target_id", default)
    require_integer("target_id", target_id, 0, task.target_count - 1)
    stage = options.get("stage", 0)
    hint = "" if task.last_stage else "Scenes of this task have no stages."
    require_integer("stage", stage, 0, task.last_stage, hint=hint)
    commands = options.get("commands")
    schedule = None if commands is None else checked_schedule(commands, task.target_count, length)
    return Selection(scene_id=int(scene_id), stage=int(stage), target_id=int(target_id), schedule=schedule)


def checked_schedule(commands: Sequence[Sequence[int]], target_count: int, length: int) -> Schedule:
    """Return changes of the command in an episode of `length` frames as whole numbers.

    Raises:
        ConfigurationError: A frame is below 1, not after the one before or so late that no action follows, or a target
            does not exist.
    """
    last = 0
    pairs = commands.tolist() if isinstance(commands, np.ndarray) else commands
    require(isinstance(pairs, list | tuple), f"commands={commands!r} is not a list of pairs of frame and target")
    for change in pairs:
        is_pair = isinstance(change, list | tuple) and len(change) == 2
        require(is_pair, f"commands={commands!r}: {change!r} is not a pair of frame and target")
        frame, target_id = change
        hint = "Frames are numbered from the start and rise; an action has to follow."
        require_integer("commands: frame", frame, last + 1, length - 1, hint=hint)
        require_integer("commands: target_id", target_id, 0, target_count - 1)
        last = frame
    return tuple((int(frame), int(target_id)) for frame, target_id in pairs)
