"""Choosing episodes: paired, non-paired or balanced subsets of an index, without touching the dataset."""

import numpy as np
import pandas as pd

from lerobot_excav.datasets.pairs.pair_coverage import pair_columns, start_columns
from lerobot_excav.datasets.pairs.paired_index import FAILED
from lerobot_excav.errors import DatasetError, require, require_choice

COMPOSITIONS = ("all", "paired", "non-paired", "balanced")


def usable(index: pd.DataFrame, *, include_failures: bool = False) -> pd.DataFrame:
    """Return the rows worth training on: not failed by the quality check, successful, one episode per pair and soil."""
    rows = index[index["qc"] != FAILED]
    if not include_failures:
        rows = rows[rows["success"]]
    return rows.sort_values("episode_index").drop_duplicates(pair_columns(index))


def select(
    index: pd.DataFrame, composition: str, *, episodes: int | None = None, scenes: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Choose a subset of episodes.

    - `all`: every row.
    - `paired`: scenes shown with every target, each with all of them.
    - `non-paired`: every scene once, targets as equally frequent as the scenes allow.
    - `balanced`: every target equally often, from whatever scenes have it.

    A scene at another stage or on another soil counts as another scene.

    Scenes are chosen at random, but the same seed chooses the same, and a smaller choice is part of a larger one
    (except that `non-paired` may show a scene with another target).

    Args:
        index: Rows to choose from, one per pair and soil.
        composition: One of `COMPOSITIONS`.
        episodes: How many episodes; as many as possible by default.
        scenes: How many scenes, in place of `episodes`; only for `paired` and `non-paired`.
        seed: Seed of the choice.

    Returns:
        The chosen rows, ordered by `episode_index`.

    Raises:
        ConfigurationError: Contradictory arguments, or a number that the composition cannot have.
        DatasetError: The index holds too few episodes.
    """
    require_choice("select", composition, COMPOSITIONS)
    require(episodes is None or scenes is None, "--episodes and --scenes exclude each other; give one of them")
    require(
        scenes is None or composition in ("paired", "non-paired"),
        f"--scenes has no meaning for --select={composition}; give --episodes",
    )
    if index.empty:
        raise DatasetError("the index has no usable episode; successes are required unless --include_failures")
    shuffled = _shuffle_scenes(index, np.random.default_rng(seed))
    if composition == "paired":
        chosen = _paired(shuffled, episodes, scenes)
    elif composition == "non-paired":
        chosen = _non_paired(shuffled, scenes if episodes is None else episodes)
    elif composition == "balanced":
        chosen = _balanced(shuffled, episodes)
    else:
        chosen = _first(shuffled, episodes, "episodes")
    return chosen.sort_values("episode_index", ignore_index=True)


def _shuffle_scenes(index: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Order rows by a random order of the scenes, then by target; adds the column `scene_rank`."""
    start = start_columns(index)
    ordered = index.sort_values([*start, "target_id"])
    number = ordered.groupby(start).ngroup().to_numpy()
    rank = rng.permutation(number.max() + 1)
    return ordered.assign(scene_rank=rank[number]).sort_values(["scene_rank", "target_id"])


def _paired(rows: pd.DataFrame, episodes: int | None, scenes: int | None) -> pd.DataFrame:
    targets = rows["target_id"].nunique()
    complete = rows.groupby("scene_rank")["target_id"].transform("nunique") == targets
    if episodes is not None:
        require(episodes % targets == 0, f"--episodes={episodes} is not a multiple of the {targets} targets per scene")
        scenes = episodes // targets
    ranks = rows[complete]["scene_rank"].drop_duplicates()
    if ranks.empty:
        raise DatasetError(
            f"no scene has a usable episode for each of the {targets} targets, so there is nothing paired to choose; "
            "record more, add --include_failures, or choose --select=balanced"
        )
    return rows[rows["scene_rank"].isin(_first(ranks, scenes, "complete scenes"))]


def _non_paired(rows: pd.DataFrame, count: int | None) -> pd.DataFrame:
    """Give each scene the target that is rarest so far among those it has."""
    ranks = _first(rows["scene_rank"].drop_duplicates(), count, "scenes")
    frequency = dict.fromkeys(sorted(rows["target_id"].unique()), 0)
    chosen = []
    for _, scene in rows[rows["scene_rank"].isin(ranks)].groupby("scene_rank"):
        target = min(scene["target_id"], key=lambda t: (frequency[t], t))
        frequency[target] += 1
        chosen.append(scene.index[scene["target_id"] == target][0])
    return rows.loc[chosen]


def _balanced(rows: pd.DataFrame, episodes: int | None) -> pd.DataFrame:
    counts = rows["target_id"].value_counts()
    per_target = int(counts.min())
    if episodes is not None:
        require(
            episodes % len(counts) == 0,
            f"--episodes={episodes} is not a multiple of {len(counts)} targets, so it cannot be balanced",
        )
        per_target = episodes // len(counts)
    groups = rows.groupby("target_id")
    return pd.concat([_first(group, per_target, f"episodes with target {target}") for target, group in groups])


def _first[Rows: (pd.DataFrame, pd.Series)](rows: Rows, count: int | None, what: str) -> Rows:
    if count is None:
        return rows
    require(count >= 1, f"the number of {what} asked for is {count}; it must be at least 1")
    if count > len(rows):
        raise DatasetError(f"{count} {what} asked for, but only {len(rows)} are there; record more, or ask for fewer")
    return rows.iloc[:count]
