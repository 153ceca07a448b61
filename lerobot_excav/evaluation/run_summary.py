"""A run in numbers: one row of a report."""

from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.measures import Column, Kind
from lerobot_excav.evaluation.comparison import matched, values_by_seed
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.seed_bootstrap import mean_over_seeds, ratio_over_seeds
from lerobot_excav.evaluation.statistics import Interval, wilson_interval


@dataclass(frozen=True, kw_only=True)
class RateOf(Interval):
    """A rate of `n` of the episodes."""

    n: int


Value = Interval | dict[str, int] | None
"""An estimate, counts by word, or None where nothing can be said."""


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """One row of a report: a run, and its measures by the key of their column."""

    run: Run
    values: dict[str, Value]

    def __getitem__(self, key: str) -> Any:
        """Return a measure by the key of its column."""
        return self.values[key]

    @property
    def counts(self) -> dict[str, int]:
        """Episodes, training seeds, and scenes with their target."""
        run = self.run
        return {"episodes": len(run.episodes), "seeds": len(run.evaluations), "scenes": len(run.keys)}

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain data."""
        values = {key: asdict(value) if isinstance(value, Interval) else value for key, value in self.values.items()}
        known = {"label": self.run.label, "task": self.run.task}
        return {**known, **self.counts, **self.run.constants, **values}


def measured(run: Run, operator: Run | None, rng: np.random.Generator) -> dict[str, Value]:
    """Return the measures of a run by the key of their column; ratios are to the operator's run, with the same scenes.

    Raises:
        DatasetError: The operator's run lacks scenes and targets, or played another world.
    """
    return {column.key: _value(column, run, operator, rng) for column in run.measures.columns}


def _value(column: Column, run: Run, operator: Run | None, rng: np.random.Generator) -> Value:
    if column.kind is Kind.MEAN:
        return mean_over_seeds(values_by_seed(run, column.field), rng)
    if column.kind is Kind.RATIO:
        if operator is None:
            return None
        return ratio_over_seeds(values_by_seed(run, column.field), matched(run, operator, column.field), rng)
    outcomes = [getattr(episode, column.field) for episode in run.episodes]
    if column.kind is Kind.COUNTS:
        found = Counter(outcomes)
        return {word: found[word] for word in column.words}
    if len(run.evaluations) > 1 and None not in outcomes:
        return mean_over_seeds(values_by_seed(run, column.field), rng)
    return _rate([outcome for outcome in outcomes if outcome is not None], of=len(outcomes))


def _rate(outcomes: list[bool], *, of: int) -> Interval | None:
    if not outcomes:
        return None
    rate = wilson_interval(sum(outcomes), len(outcomes))
    return rate if len(outcomes) == of else RateOf(**asdict(rate), n=len(outcomes))
