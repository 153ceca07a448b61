"""Which scene and target an episode plays: from options, else seed, else by chance."""

from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.settings import require_integer
from lerobot_excav.errors import require_choice

RESET_OPTIONS = ("scene_id", "target_id")


def select_scene_and_target(
    seed: int | None, options: dict[str, Any], *, rng: np.random.Generator, target_count: int
) -> tuple[int, int]:
    """Choose scene and target of an episode.

    Args:
        seed: Seed of the reset; without options it is the scene, and its remainder the target.
        options: May hold `scene_id` and `target_id`, and LeRobot's own keys, which begin with `lerobot_`.
        rng: Source of the scene when neither is given.
        target_count: Targets of a scene.

    Returns:
        Scene and target.

    Raises:
        ConfigurationError: `scene_id` or `target_id` is no integer or out of range, or an option is unknown.
    """
    for key in options:
        if not key.startswith("lerobot_"):
            require_choice("options", key, RESET_OPTIONS)
    number = int(rng.integers(2**31)) if seed is None else seed
    scene_id = options.get("scene_id", number)
    require_integer("scene_id", scene_id, 0, 2**63 - 1)
    target_id = options.get("target_id", scene_id % target_count)
    require_integer("target_id", target_id, 0, target_count - 1)
    return int(scene_id), int(target_id)
