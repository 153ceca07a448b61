"""Two runs on the same scenes and targets, compared pair by pair."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.measures import Column, EpisodeKey, Kind
from lerobot_excav.errors import DatasetError, require
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.statistics import Interval, mcnemar_exact, newcombe_interval, paired_bootstrap


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Difference of one measure between two runs.

    Attributes:
        measure: Key of its column.
        difference: Second minus first, over scenes and targets; with Newcombe's interval where there is a p-value, else
            with the bootstrap's.
        p_value: McNemar's exact test; None for measures that are not rates, or with several seeds, whose episodes on
            one scene are not independent.
    """

    measure: str
    difference: Interval
    p_value: float | None


def compare(first: Run, second: Run, rng: np.random.Generator) -> list[Difference]:
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
    return [_difference(first.measures.column(key), first, second, rng) for key in first.measures.compared]


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
    return np.array([_mean(reference, key, measure) for key in run.keys])


def require_same_task(first: Run, second: Run) -> None:
    """Raise `DatasetError` unless two runs are of one task."""
    if first.task != second.task:
        raise DatasetError(f"{first.label} is of {first.task} and {second.label} of {second.task}; report them apart")


def difference_of_worlds(first: Run, second: Run) -> str:
    """Say why the scenes of two runs differ although their numbers are the same; an empty string if they do not."""
    if first.world == second.world:
        return ""
    played = " and ".join(f"{run.label} {run.world}" for run in (first, second))
    return f"{played}, where a number means another scene"


def means_by_key(run: Run, measure: str) -> NDArray[Any]:
    """Return a measure per scene and target, averaged over seeds, in the order of `run.keys`."""
    return np.array([_mean(run, key, measure) for key in run.keys])


def _require_same_world(first: Run, second: Run) -> None:
    require_same_task(first, second)
    if difference := difference_of_worlds(first, second):
        raise DatasetError(f"{difference}; play both alike, or report them apart")


def _some(keys: Collection[EpisodeKey]) -> str:
    return f"{len(keys)} scenes and targets ({', '.join(map(str, sorted(keys)[:3]))}, …)"


def _mean(run: Run, key: EpisodeKey, measure: str) -> float:
    return float(np.mean([getattr(evaluation.episodes[key], measure) for evaluation in run.evaluations]))


def _difference(column: Column, first: Run, second: Run, rng: np.random.Generator) -> Difference:
    values = means_by_key(first, column.field), means_by_key(second, column.field)
    if column.kind is Kind.RATE and len(first.evaluations) == len(second.evaluations) == 1:
        before, after = (outcomes == 1.0 for outcomes in values)
        both, neither = int(np.sum(before & after)), int(np.sum(~before & ~after))
        first_only, second_only = int(np.sum(before & ~after)), int(np.sum(~before & after))
        return Difference(
            measure=column.key,
            difference=newcombe_interval(both, first_only, second_only, neither),
            p_value=mcnemar_exact(first_only, second_only),
        )
    return Difference(measure=column.key, difference=paired_bootstrap(*values, rng), p_value=None)
