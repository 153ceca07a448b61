"""How far apart several masks drive the actions and the tool from one and the same state, over time."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.evaluation.audit.branch import Branch


@dataclass(frozen=True, kw_only=True)
class Separation:
    """Mean distance between two branches of a scene, frame by frame.

    Attributes:
        actions: Of the actions, in their own units, root mean square over their elements (n,).
        tool_m: Of the tool (n,) [m].
        scenes: How many scenes have a pair that lasts so long (n,).
    """

    actions: list[float]
    tool_m: list[float]
    scenes: list[int]


def separation(branches: Sequence[Branch]) -> Separation:
    """Average over the pairs of each scene, then over the scenes, as long as half of the scenes have a pair."""
    by_scene = defaultdict(list)
    for branch in branches:
        by_scene[branch.scene_id].append(branch)
    scenes = [curves for scene in by_scene.values() if (curves := _scene_curves(scene)) is not None]
    if not scenes:
        return Separation(actions=[], tool_m=[], scenes=[])
    lengths = np.array([len(curves) for curves in scenes])
    longest = int(np.sort(lengths)[(len(lengths) - 1) // 2])  # the lower middle: at least half last so long
    padded = np.full((len(scenes), longest, 2), np.nan)
    for row, curves in zip(padded, scenes, strict=True):
        row[: len(curves)] = curves[:longest]
    actions, tool_m = np.nanmean(padded, axis=0).T
    counts = (~np.isnan(padded[..., 0])).sum(axis=0)
    return Separation(
        actions=np.round(actions, 4).tolist(), tool_m=np.round(tool_m, 4).tolist(), scenes=counts.tolist()
    )


def _scene_curves(branches: Sequence[Branch]) -> NDArray[np.float64] | None:
    """Return the mean distances of a scene's pairs, of actions and of the tool, (n, 2), as long as all pairs last."""
    pairs = [_distances(*pair) for pair in combinations(branches, 2)]
    if not pairs:
        return None
    length = min(map(len, pairs))
    return np.asarray(np.mean([pair[:length] for pair in pairs], axis=0))


def _distances(one: Branch, other: Branch) -> NDArray[np.float64]:
    length = min(len(one.actions), len(other.actions))
    actions = np.array(one.actions[:length]) - np.array(other.actions[:length])
    tools_m = np.array(one.tool_path_w[:length]) - np.array(other.tool_path_w[:length])
    return np.stack([np.sqrt(np.mean(actions**2, axis=1)), np.linalg.norm(tools_m, axis=1)], axis=1)
