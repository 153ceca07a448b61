"""Splitting episodes into training and evaluation, in the terms of stock `lerobot-train`.

`lerobot-train` holds out the last `ceil(n * eval_split)` episodes of the list it is given. So the held-out episodes go
last, and `eval_split = (k - 0.5) / n` makes the rounding give exactly k, whatever n is.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from lerobot_excav.datasets.pairs.pair_coverage import SCENE_COLUMNS
from lerobot_excav.errors import DatasetError, require, require_choice

SPLIT_UNITS = ("scene", "episode")


@dataclass(frozen=True, kw_only=True)
class Split:
    """Episodes for training and for evaluation.

    Attributes:
        train: Episode indices.
        evaluation: Episode indices that training never sees.
    """

    train: list[int]
    evaluation: list[int]

    @property
    def eval_split(self) -> float:
        """The value of `--dataset.eval_split` that holds out exactly the evaluation episodes."""
        held_out = len(self.evaluation)
        return (held_out - 0.5) / (len(self.train) + held_out) if held_out else 0.0

    def flags(self) -> list[str]:
        """Return the flags of `lerobot-train`, unquoted."""
        episodes = ",".join(str(index) for index in [*self.train, *self.evaluation])
        return [f"--dataset.episodes=[{episodes}]", f"--dataset.eval_split={self.eval_split!r}"]


def split(rows: pd.DataFrame, unit: str, *, eval_fraction: float = 0.2, seed: int = 0) -> Split:
    """Hold out a part of the episodes.

    Args:
        rows: Rows of a paired-scene index.
        unit: `scene` holds out whole scenes, at all stages and on all soils, so none is in both parts; `episode` holds
            out single episodes.
        eval_fraction: Part of the units to hold out, in [0, 1); at least one unit unless it is 0.
        seed: Seed of the choice.

    Raises:
        ConfigurationError: A value out of range.
        DatasetError: Nothing would be left to train on.
    """
    require_choice("split", unit, SPLIT_UNITS)
    require(0.0 <= eval_fraction < 1.0, f"--eval_fraction={eval_fraction} is out of range; allowed: 0 <= f < 1")
    ordered = rows.sort_values("episode_index")
    unit_number = ordered.groupby(SCENE_COLUMNS).ngroup() if unit == "scene" else pd.RangeIndex(len(ordered))
    numbers = np.asarray(unit_number)
    count = len(set(numbers.tolist()))
    held_out_count = 0 if eval_fraction == 0.0 else max(1, round(count * eval_fraction))
    if held_out_count >= count:
        raise DatasetError(f"holding out {held_out_count} of {count} {unit}s leaves nothing to train on")
    held_out = np.isin(numbers, np.random.default_rng(seed).permutation(count)[:held_out_count])
    episodes = ordered["episode_index"].to_numpy()
    return Split(train=episodes[~held_out].tolist(), evaluation=episodes[held_out].tolist())
