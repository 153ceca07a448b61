"""How closely the place where a machine acted follows the place that a mask shows."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.evaluation.audit.branch import Branch
from lerobot_excav.evaluation.statistics import Interval, bootstrap_mean, bootstrap_ratio, wilson_interval


@dataclass(frozen=True, kw_only=True)
class Obedience:
    """What the masks of several scenes led to, from the start on; None where nothing can be said.

    Attributes:
        scenes: Scenes.
        compared_scenes: Those in which at least two masks made the machine act, of which the slope is made.
        branches: Masks shown, over all scenes.
        acted: Which part of them made the machine act at all.
        success: Which part of them ended in success.
        slope: Regression of the acted on the commanded places, both as deviations from the scene's mean over its masks:
            1 is obedience, 0 is a default place.
        entry_error_m: Distance between where acting began and the middle of what was commanded [m].
        share: Which part of the change lies where it was commanded.
        relative_share: That, divided by the operator's on the same scenes.
    """

    scenes: int
    compared_scenes: int
    branches: int
    acted: Interval
    success: Interval
    slope: Interval | None
    entry_error_m: Interval | None
    share: Interval | None
    relative_share: Interval | None


def obedience(branches: Sequence[Branch], operator: Sequence[Branch], rng: np.random.Generator) -> Obedience:
    """Measure the branches that begin with the start; intervals of slope, error and shares are over scenes.

    Args:
        branches: At least one.
        operator: Those of the operator on the same scenes.
        rng: Generator of the bootstrap.
    """
    by_scene = _acted_by_scene(branches)
    compared = [scene for scene in by_scene.values() if len(scene) > 1]
    return Obedience(
        scenes=len({branch.scene_id for branch in branches}),
        compared_scenes=len(compared),
        branches=len(branches),
        acted=wilson_interval(sum(branch.acted_w is not None for branch in branches), len(branches)),
        success=wilson_interval(sum(branch.is_success for branch in branches), len(branches)),
        slope=_slope(compared, rng),
        entry_error_m=_mean([float(np.mean([entry_error_m(b) for b in scene])) for scene in by_scene.values()], rng),
        share=_mean(list(_shares(by_scene).values()), rng),
        relative_share=_relative_share(_shares(by_scene), _shares(_acted_by_scene(operator)), rng),
    )


def deviations_m(branches: Sequence[Branch]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return commanded and acted places of a scene's branches, each (n, 2) [m], less their means."""
    commanded_w = np.array([branch.commanded_w for branch in branches])
    acted_w = np.array([branch.acted_w for branch in branches])
    return commanded_w - commanded_w.mean(axis=0), acted_w - acted_w.mean(axis=0)


def entry_error_m(branch: Branch) -> float:
    """Return the distance between where acting began and what was commanded [m]."""
    assert branch.began_w is not None  # it has acted
    return float(np.hypot(*(np.array(branch.began_w) - branch.commanded_w)))


def _acted_by_scene(branches: Sequence[Branch]) -> dict[int, list[Branch]]:
    by_scene = defaultdict(list)
    for branch in branches:
        if branch.acted_w is not None:
            by_scene[branch.scene_id].append(branch)
    return by_scene


def _slope(scenes: Sequence[Sequence[Branch]], rng: np.random.Generator) -> Interval | None:
    """Regress through the origin: sum of products over sum of squares, both by scene for the bootstrap."""
    sums = [(np.sum(told * did), np.sum(told * told)) for told, did in map(deviations_m, scenes)]
    if not sums:
        return None
    products, squares = np.array(sums).T
    return bootstrap_ratio(products, squares, rng)


def _shares(by_scene: Mapping[int, Sequence[Branch]]) -> dict[int, float]:
    return {scene_id: float(np.mean([branch.share for branch in scene])) for scene_id, scene in by_scene.items()}


def _relative_share(
    shares: Mapping[int, float], operator: Mapping[int, float], rng: np.random.Generator
) -> Interval | None:
    both = [(share, operator[scene_id]) for scene_id, share in shares.items() if scene_id in operator]
    if not both or not any(theirs for _, theirs in both):
        return None
    mine, theirs = np.array(both).T
    return bootstrap_ratio(mine, theirs, rng)


def _mean(values: Sequence[float], rng: np.random.Generator) -> Interval | None:
    return bootstrap_mean(np.array(values), rng) if values else None
