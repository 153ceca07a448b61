"""Which targets a start is shown with."""

import numpy as np

from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import SCENE_SETS, TARGETS_PER_SCENE, TaskSettings
from lerobot_excav.errors import require_choice

TARGET_RULES = ("round", "uniform", "nearest")

# Keeps the draws apart from those of the operator, whose generators have the same seed.
_STREAM = 0x7A26


def targets_of_start(
    rule: str, count: int, *, seed: int, settings: TaskSettings, scene_id: int, stage: int = 0, place: int = 0
) -> list[int]:
    """Return the targets that a start is shown with.

    Args:
        rule: `round` goes round the targets from start to start, so that all are equally frequent; `uniform` draws one,
            whatever other starts are drawn for; `nearest` takes the one that the task tells as the nearest.
        count: How many; the latter two choose one.
        seed: Seed of `uniform`.
        settings: Settings of the environment; its task may have a target with which `round` begins in every scene.
        scene_id: Scene.
        stage: Cycles dug before the start.
        place: Place of the stage among those at which a scene is shown.

    Raises:
        ConfigurationError: There is no such rule.
    """
    require_choice("target_rule", rule, TARGET_RULES)
    spec = task_of_settings(settings)
    if rule == "uniform":
        start = (SCENE_SETS.index(settings.scene_set), scene_id)
        rng = np.random.default_rng((_STREAM, seed, *start, stage) if stage else (_STREAM, seed, *start))
        return [int(rng.integers(TARGETS_PER_SCENE))]
    if rule == "nearest":
        return [spec.nearest_target(settings, scene_id, stage)]
    first = scene_id + place if spec.default_target is None else spec.default_target
    return sorted((first + k) % TARGETS_PER_SCENE for k in range(count))
