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
    index: pd.DataFrame, composition: str, *, episodes: int | None = None, starts: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Choose a subset of episodes.

    - `all`: every row.
    - `paired`: starts shown with every target, each with all of them.
    - `non-paired`: every start once, targets as equally frequent as the starts allow.
    - `balanced`: every target equally often, from whatever starts have it.

    A start is a scene at a stage, on a soil.

    Starts are chosen at random, but the same seed chooses the same, and a smaller choice is part of a larger one
    (except that `non-paired` may show a start with another target).

    Args:
        index: Rows to choose from, one per pair and soil.
        composition: One of `COMPOSITIONS`.
        episodes: How many episodes; as many as possible by default.
        starts: How many starts, in place of `episodes`; only for `paired` and `non-paired`.
        seed: Seed of the choice.

    Returns:
        The chosen rows, ordered by `episode_index`.

    Raises:
        ConfigurationError: Contradictory arguments, or a number that the composition cannot have.
        DatasetError: The index holds too few episodes.
    """
    require_choice("select", composition, COMPOSITIONS)
    require(episodes is None or starts is None, "--episodes and --starts exclude each other; give one of them")
    require(
        starts is None or composition in ("paired", "non-paired"),
        f"--starts has no meaning for --select={composition}; give --episodes",
    )
    if index.empty:
        raise DatasetError("the index has no usable episode; successes are required unless --include_failures")
    shuffled = _shuffle_starts(index, np.random.default_rng(seed))
    if composition == "paired":
        chosen = _paired(shuffled, episodes, starts)
    elif composition == "non-paired":
        chosen = _non_paired(shuffled, starts if episodes is None else episodes)
    elif composition == "balanced":
        chosen = _balanced(shuffled, episodes)
    else:
        chosen = _first(shuffled, episodes, "episodes")
    return chosen.sort_values("episode_index", ignore_index=True)


def _shuffle_starts(index: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Order rows by a random order of the starts, then by target; adds the column `start_rank`."""
    start = start_columns(index)
    ordered = index.sort_values([*start, "target_id"])
    number = ordered.groupby(start).ngroup().to_numpy()
    rank = rng.permutation(number.max() + 1)
    return ordered.assign(start_rank=rank[number]).sort_values(["start_rank", "target_id"])


def _paired(rows: pd.DataFrame, episodes: int | None, starts: int | None) -> pd.DataFrame:
    targets = rows["target_id"].nunique()
    complete = rows.groupby("start_rank")["target_id"].transform("nunique") == targets
    if episodes is not None:
        require(episodes % targets == 0, f"--episodes={episodes} is not a multiple of the {targets} targets per start")
        starts = episodes // targets
    ranks = rows[complete]["start_rank"].drop_duplicates()
    if ranks.empty:
        raise DatasetError(
            f"no start has a usable episode for each of the {targets} targets, so there is nothing paired to choose; "
            "record more, add --include_failures, or choose --select=balanced"
        )
    return rows[rows["start_rank"].isin(_first(ranks, starts, "complete starts"))]


def _non_paired(rows: pd.DataFrame, count: int | None) -> pd.DataFrame:
    """Give each start the target that is rarest so far among those it has."""
    ranks = _first(rows["start_rank"].drop_duplicates(), count, "starts")
    frequency = dict.fromkeys(sorted(rows["target_id"].unique()), 0)
    chosen = []
    for _, start in rows[rows["start_rank"].isin(ranks)].groupby("start_rank"):
        target = min(start["target_id"], key=lambda t: (frequency[t], t))
        frequency[target] += 1
        chosen.append(start.index[start["target_id"] == target][0])
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
