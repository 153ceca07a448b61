"""Which targets a scene is shown with."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from lerobot_excav.envs.tasks.settings import SCENE_SETS, TARGETS_PER_SCENE

TargetRule = Literal["round", "uniform", "nearest"]
TARGET_RULES: tuple[TargetRule, ...] = ("round", "uniform", "nearest")

# Keeps the draws apart from those of the operator, whose generators have the same seed.
_STREAM = 0x7A26


def targets_in_turn(scene_id: int, count: int) -> list[int]:
    """Return `count` targets of a scene, going round them from scene to scene, so that all are equally frequent."""
    return sorted((scene_id + k) % TARGETS_PER_SCENE for k in range(count))


def target_by_lot(seed: int, scene_set: str, scene_id: int) -> int:
    """Draw one target of a scene; a scene's draw does not depend on which other scenes are drawn for."""
    rng = np.random.default_rng((_STREAM, seed, SCENE_SETS.index(scene_set), scene_id))
    return int(rng.integers(TARGETS_PER_SCENE))


def targets_of_scene(
    rule: str,
    count: int,
    *,
    seed: int,
    scene_set: str,
    scene_id: int,
    nearest: Callable[[str, int], int] | None,
) -> list[int]:
    """Return the targets that a scene is shown with.

    Args:
        rule: `round`, `uniform` or `nearest`.
        count: How many; the latter two choose one.
        seed: Seed of `uniform`.
        scene_set: Scene set.
        scene_id: Scene.
        nearest: Returns the nearest target of a scene.
    """
    if rule == "uniform":
        return [target_by_lot(seed, scene_set, scene_id)]
    if rule == "nearest" and nearest is not None:
        return [nearest(scene_set, scene_id)]
    return targets_in_turn(scene_id, count)
