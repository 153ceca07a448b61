"""Two runs on the same scenes and targets, compared pair by pair."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.errors import DatasetError, require
from lerobot_excav.evaluation.episode import EpisodeKey
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.statistics import (
    Interval,
    mcnemar_exact,
    newcombe_interval,
    paired_bootstrap,
)
from lerobot_excav.evaluation.task_table import Column, Kind


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Difference of one measure between two runs.

    Attributes:
        measure: Field of the task's `Episode`.
        difference: Second minus first, over scenes and targets; with Newcombe's interval where there is a p-value, else
            with the bootstrap's.
        p_value: McNemar's exact test; None for measures that are no rates, or with several seeds, whose episodes on
            one scene are not independent.
    """

    measure: str
    difference: Interval
    p_value: float | None


def compare(first: Run, second: Run, rng: np.random.Generator) -> list[Difference]:
    """Compare two runs.

    Args:
        first: Reference.
        second: What is compared with it.
        rng: Source of the bootstrap.

    Raises:
        DatasetError: The runs are of different tasks, show different scenes or targets, or played different worlds.
    """
    require_same_keys(first, second)
    return [_difference(first.table.column(key), first, second, rng) for key in first.table.compared]


def require_same_keys(first: Run, second: Run) -> None:
    """Raise `DatasetError` unless two runs show the same scenes and targets."""
    _require_same_world(first, second)
    missing = set(first.keys) ^ set(second.keys)
    if missing:
        examples = ", ".join(str(key) for key in sorted(missing)[:3])
        raise DatasetError(
            f"{first.label} and {second.label} differ in {len(missing)} scenes and targets ({examples}, …), so they "
            "cannot be compared pairwise; evaluate both with the same --seed and --eval.n_episodes"
        )


def require_same_task(first: Run, second: Run) -> None:
    """Raise `DatasetError` unless two runs are of one task."""
    if first.table is not second.table:
        raise DatasetError(
            f"{first.label} is of {first.table.task} and {second.label} of {second.table.task}; report them apart"
        )


def difference_of_worlds(first: Run, second: Run) -> str:
    """Say why the scenes of two runs differ although their numbers are the same; an empty string if they do not."""
    if first.world == second.world:
        return ""
    played = " and ".join(f"{run.label} {run.world}" for run in (first, second))
    return f"{played}, where a number means another scene"


def _require_same_world(first: Run, second: Run) -> None:
    require_same_task(first, second)
    difference = difference_of_worlds(first, second)
    if difference:
        raise DatasetError(f"{difference}; play both alike, or report them apart")


def means_by_key(run: Run, measure: str) -> NDArray[Any]:
    """Return a measure per scene and target, averaged over seeds, in the order of `run.keys`."""
    return np.array([_mean(run, key, measure) for key in run.keys])


def _mean(run: Run, key: EpisodeKey, measure: str) -> float:
    return float(np.mean([getattr(evaluation.episodes[key], measure) for evaluation in run.evaluations]))


def _difference(column: Column, first: Run, second: Run, rng: np.random.Generator) -> Difference:
    values = means_by_key(first, column.field), means_by_key(second, column.field)
    if column.kind is Kind.RATE and len(first.evaluations) == len(second.evaluations) == 1:
        return _difference_of_rates(column.field, *(outcomes == 1.0 for outcomes in values))
    return Difference(measure=column.field, difference=paired_bootstrap(*values, rng), p_value=None)


def _difference_of_rates(measure: str, first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Difference:
    both, neither = int(np.sum(first & second)), int(np.sum(~first & ~second))
    first_only, second_only = int(np.sum(first & ~second)), int(np.sum(~first & second))
    return Difference(
        measure=measure,
        difference=newcombe_interval(both, first_only, second_only, neither),
        p_value=mcnemar_exact(first_only, second_only),
    )


def matched(run: Run, reference: Run, measure: str) -> NDArray[Any]:
    """Return the reference's measure on the scenes and targets of a run, in the order of `run.keys`.

    Raises:
        DatasetError: The reference lacks one of them.
    """
    _require_same_world(run, reference)
    missing = set(run.keys) - set(reference.keys)
    if missing:
        examples = ", ".join(str(key) for key in sorted(missing)[:3])
        raise DatasetError(
            f"the operator's run lacks {len(missing)} scenes and targets of {run.label} ({examples}, …); "
            "make it longer with `lerobot-excav bench operator --scenes=…`"
        )
    require(len(reference.evaluations) == 1, "the operator's run must be a single evaluation")
    return np.array([_mean(reference, key, measure) for key in run.keys])
