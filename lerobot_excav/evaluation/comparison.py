"""Two runs on the same scenes and targets, compared pair by pair."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.measures import Column, EpisodeKey, Kind
from lerobot_excav.errors import DatasetError, require
from lerobot_excav.evaluation.crossed_effects import difference_over_seeds
from lerobot_excav.evaluation.metrics import Evaluation
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.statistics import (
    Interval,
    cautious_correlation_of_rates,
    difference_of_rates,
    mcnemar_exact,
    newcombe_interval,
    wilson_interval,
)


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Difference of one measure between two runs.

    Attributes:
        measure: Key of its column.
        difference: Second minus first, over scenes and targets; of rates with single seeds with Newcombe's interval,
            else with that of `crossed_effects`, over seeds and scenes.
        p_value: McNemar's exact test where the interval is Newcombe's, else that of `crossed_effects`; None where a
            single scene tells nothing.
        p_corrected: Corrected for the number of rows that are compared with one reference; None where only one is, or
            where there is no p-value.
    """

    measure: str
    difference: Interval
    p_value: float | None
    p_corrected: float | None = None


def compare(first: Run, second: Run) -> list[Difference]:
    """Compare a second run with a first, its reference.

    Raises:
        DatasetError: The runs are of different tasks, show different scenes or targets, or played different worlds.
    """
    _require_same_world(first, second)
    if missing := set(first.keys) ^ set(second.keys):
        raise DatasetError(
            f"{first.label} and {second.label} differ in {_some(missing)}, so they "
            "cannot be compared pairwise; evaluate both with the same --seed and --eval.n_episodes"
        )
    return [_difference(first.measures.column(key), first, second) for key in first.measures.compared]


def matched(run: Run, reference: Run, measure: str) -> NDArray[Any]:
    """Return the reference's measure on the scenes and targets of a run, in the order of `run.keys`.

    Raises:
        DatasetError: The reference lacks one of them.
    """
    _require_same_world(run, reference)
    if missing := set(run.keys) - set(reference.keys):
        raise DatasetError(
            f"the operator's run lacks {_some(missing)} of {run.label}; "
            "make it longer with `lerobot-excav operator --scenes=…`"
        )
    require(len(reference.evaluations) == 1, "the operator's run must be a single evaluation")
    return np.array([_value(reference.first, key, measure) for key in run.keys])


def require_same_task(first: Run, second: Run) -> None:
    """Raise `DatasetError` unless two runs are of one task."""
    if first.task != second.task:
        raise DatasetError(f"{first.label} is of {first.task} and {second.label} of {second.task}; report them apart")


def difference_of_worlds(first: Run, second: Run) -> str:
    """Say why the scenes of two runs differ although their numbers are the same; an empty string if they do not."""
    if first.world == second.world:
        return ""
    played = " and ".join(f"{run.label} {run.world}" for run in (first, second))
    return f"{played}, so the same numbers are not the same scenes under the same conditions"


def values_by_seed(run: Run, measure: str) -> NDArray[np.float64]:
    """Return a measure (seeds, scenes and targets), in the order of `run.keys`."""
    return np.array([[_value(evaluation, key, measure) for key in run.keys] for evaluation in run.evaluations])


def _require_same_world(first: Run, second: Run) -> None:
    require_same_task(first, second)
    if difference := difference_of_worlds(first, second):
        raise DatasetError(f"{difference}; play both alike, or report them apart")


def _some(keys: Collection[EpisodeKey]) -> str:
    return f"{len(keys)} scenes and targets ({', '.join(map(str, sorted(keys)[:3]))}, …)"


def _value(evaluation: Evaluation, key: EpisodeKey, measure: str) -> float:
    return float(getattr(evaluation.episodes[key], measure))


def _difference(column: Column, first: Run, second: Run) -> Difference:
    values = values_by_seed(first, column.field), values_by_seed(second, column.field)
    if column.kind is Kind.RATE and len(first.evaluations) == len(second.evaluations) == 1:
        of_rates, exact = _paired_rates(values[0][0] == 1.0, values[1][0] == 1.0)
        return Difference(measure=column.key, difference=of_rates, p_value=exact)
    are_trained = first.first.operator is None, second.first.operator is None
    difference, p_value = difference_over_seeds(*values, are_trained=are_trained)
    if column.kind is Kind.RATE:
        difference, p_value = _no_surer_than_scenes(difference, p_value, *(each.mean(axis=0) for each in values))
    return Difference(measure=column.key, difference=difference, p_value=p_value)


def _no_surer_than_scenes(
    difference: Interval, p_value: float | None, before: NDArray[np.float64], after: NDArray[np.float64]
) -> tuple[Interval, float | None]:
    """Let a difference of rates be no surer than its scenes allow, given the rate on each of them over the seeds.

    Where all episodes end alike nothing varies, and still they might have ended otherwise. So an interval is at least
    as wide as Wilson's intervals over the scenes make it, and no p-value is below the least that a test can reach which
    turns signs around: that of m scenes that differ is 2 / 2**m.
    """
    first, second = (wilson_interval(round(rates.sum()), len(rates)) for rates in (before, after))
    least = difference_of_rates(first, second, correlation=cautious_correlation_of_rates(before, after))
    low = min(difference.low, difference.estimate - (least.estimate - least.low))
    high = max(difference.high, difference.estimate + (least.high - least.estimate))
    least_p = min(1.0, 2.0 ** (1 - int(np.count_nonzero(before != after))))
    wide = replace(difference, low=max(-1.0, low), high=min(1.0, high))
    return wide, None if p_value is None else max(p_value, least_p)


def _paired_rates(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> tuple[Interval, float]:
    """Return the difference of two rates on the same scenes, and the p-value of equal ones."""
    first_only, second_only = int(np.sum(before & ~after)), int(np.sum(~before & after))
    both, neither = int(np.sum(before & after)), int(np.sum(~before & ~after))
    return newcombe_interval(both, first_only, second_only, neither), mcnemar_exact(first_only, second_only)
