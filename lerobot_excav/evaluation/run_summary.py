"""A run in numbers: one row of a report."""

from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.measures import Column, Kind
from lerobot_excav.evaluation.comparison import matched, values_by_seed
from lerobot_excav.evaluation.crossed_effects import mean_over_seeds, ratio_over_seeds
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.statistics import Interval, bootstrap_mean, bootstrap_ratio, wilson_interval


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
    if column.kind is Kind.COUNTS:
        found = Counter(getattr(episode, column.field) for episode in run.episodes)
        return {word: found[word] for word in column.words}
    if column.kind is Kind.RATE:
        return _rate(column, run)
    if column.kind is Kind.RATIO and operator is None:
        return None
    values = values_by_seed(run, column.field)
    if operator is None or column.kind is Kind.MEAN:
        mean = mean_over_seeds(values) if len(values) > 1 else bootstrap_mean(values[0], rng)
        return mean if column.bounds is None else _within(mean, *column.bounds)
    theirs = matched(run, operator, column.field)
    return ratio_over_seeds(values, theirs) if len(values) > 1 else bootstrap_ratio(values[0], theirs, rng)


def _within(interval: Interval, low: float, high: float) -> Interval:
    """Cut an interval off where nothing can be: Student's knows nothing of bounds."""
    return replace(interval, low=max(low, interval.low), high=min(high, interval.high))


def _rate(column: Column, run: Run) -> Interval | None:
    """Return a rate; of episodes that all say something, and several seeds, with an interval over both.

    That is no narrower than Wilson's over the scenes: where all episodes end alike, they still may not have.
    """
    outcomes = [getattr(episode, column.field) for episode in run.episodes]
    known = [outcome for outcome in outcomes if outcome is not None]
    if not known:
        return None
    if len(run.evaluations) == 1 or len(known) < len(outcomes):
        rate = wilson_interval(sum(known), len(known))
        return rate if len(known) == len(outcomes) else RateOf(**asdict(rate), n=len(known))
    crossed = mean_over_seeds(values_by_seed(run, column.field))
    least = wilson_interval(round(crossed.estimate * len(run.keys)), len(run.keys))
    wide = replace(crossed, low=min(crossed.low, least.low), high=max(crossed.high, least.high))
    return _within(wide, 0.0, 1.0)
