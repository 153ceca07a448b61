"""Which targets a scene is shown with."""

from collections.abc import Callable

import numpy as np

from lerobot_excav.envs.tasks.settings import SCENE_SETS, TARGETS_PER_SCENE
from lerobot_excav.errors import require_choice

TARGET_RULES = ("round", "uniform", "nearest")

# Keeps the draws apart from those of the operator, whose generators have the same seed.
_STREAM = 0x7A26


def targets_of_scene(
    rule: str,
    count: int,
    *,
    seed: int,
    scene_set: str,
    scene_id: int,
    nearest: Callable[[str, int], int],
    default: int | None = None,
) -> list[int]:
    """Return the targets that a scene is shown with.

    Args:
        rule: `round` goes round the targets from scene to scene, so that all are equally frequent; `uniform` draws one,
            whatever other scenes are drawn for; `nearest` takes that one.
        count: How many; the latter two choose one.
        seed: Seed of `uniform`.
        scene_set: Scene set.
        scene_id: Scene.
        nearest: Returns the nearest target of a scene.
        default: Target with which `round` begins in every scene, where a task has one.

    Raises:
        ConfigurationError: There is no such rule.
    """
    require_choice("target_rule", rule, TARGET_RULES)
    if rule == "uniform":
        rng = np.random.default_rng((_STREAM, seed, SCENE_SETS.index(scene_set), scene_id))
        return [int(rng.integers(TARGETS_PER_SCENE))]
    if rule == "nearest":
        return [nearest(scene_set, scene_id)]
    first = scene_id if default is None else default
    return sorted((first + k) % TARGETS_PER_SCENE for k in range(count))
