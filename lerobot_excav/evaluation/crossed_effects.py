"""Means and differences over training seeds and scenes, both drawn from many that could have been.

Episodes of one training are not independent of each other, and neither are episodes on one scene. The variance of a
mean over S seeds and N scenes is taken as that of the seeds' means over S plus that of the scenes' means over N; what
is left of an episode's own variance counts in both, which errs on the wide side. Intervals and p-values are Student's,
and their degrees of freedom those of F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110-114: with three seeds that
differ much, they are as uncertain as three numbers are; in simulations, 95 % intervals of three seeds held the truth in
91 to 95 % of the cases. A single seed tells nothing of seeds: it is taken to vary as those it is compared with, and
where all have a single one, all is said of these trainings.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from lerobot_excav.errors import require
from lerobot_excav.evaluation.statistics import CONFIDENCE, Interval


class _Part(NamedTuple):
    """What a mean of independent numbers adds to the variance of an estimate, and its degrees of freedom."""

    variance: float
    freedom: int


def mean_over_seeds(values: NDArray[Any]) -> Interval:
    """Estimate the mean of values (seeds, scenes).

    Raises:
        ConfigurationError: No values.
    """
    _require_values(values)
    return _interval(float(values.mean()), *_error(_parts(values.mean(axis=1), values.mean(axis=0))))


def ratio_over_seeds(values: NDArray[Any], reference: NDArray[Any]) -> Interval:
    """Estimate the mean of values (seeds, scenes) over that of a reference (scenes,), which knows no seeds.

    To first order: the errors are those of `values - ratio * reference`.

    Raises:
        ConfigurationError: No values, other scenes, or a reference without a positive mean.
    """
    _require_values(values, reference[None])
    scale = float(reference.mean())
    require(scale > 0.0, "the operator's mean is zero, so nothing can be related to it")
    ratio = float(values.mean()) / scale
    residuals = (values.mean(axis=0) - ratio * reference) / scale
    return _interval(ratio, *_error(_parts(values.mean(axis=1) / scale, residuals)))


def difference_over_seeds(
    first: NDArray[Any], second: NDArray[Any], *, are_trained: tuple[bool, bool] = (True, True)
) -> tuple[Interval, float | None]:
    """Estimate `second - first`, each (its seeds, the same scenes), paired by scene; return it and its p-value.

    `are_trained` says which of them other seeds might have made otherwise: an operator is not. A single scene played by
    single trainings tells nothing of either, so it has no p-value, and an interval without width.

    Raises:
        ConfigurationError: No values, or other scenes.
    """
    _require_values(first, second)
    by_scene = second.mean(axis=0) - first.mean(axis=0)
    parts = _parts(by_scene) + _parts_of_seeds(first.mean(axis=1), second.mean(axis=1), are_trained)
    estimate, (error, freedom) = float(by_scene.mean()), _error(parts)
    if not parts:
        return _interval(estimate, error, freedom), None
    if error == 0.0:
        return _interval(estimate, error, freedom), 1.0 if estimate == 0.0 else 0.0
    p_value = 2.0 * float(stats.t.sf(abs(estimate) / error, freedom))
    return _interval(estimate, error, freedom), p_value


def holm(p_values: Sequence[float], *, family: int | None = None) -> list[float]:
    """Return p-values corrected for their number, in their order (S. Holm, Scand. J. Stat. 6 (1979) 65-70).

    `family` is the number of all comparisons that were planned, of which some may not be known yet; those count as the
    largest ones.

    Raises:
        ConfigurationError: More p-values than that.
    """
    most = len(p_values) if family is None else family
    require(most >= len(p_values), f"family={family} is less than the number of p-values, {len(p_values)}")
    order = np.argsort(p_values, kind="stable")
    corrected = np.empty(len(order))
    corrected[order] = np.maximum.accumulate(np.array(p_values)[order] * (most - np.arange(len(order))))
    return [float(value) for value in np.minimum(corrected, 1.0)]


def _parts(*means: NDArray[Any]) -> list[_Part]:
    """Return the parts of means of independent numbers; one number alone tells nothing of its variance."""
    return [_Part(float(part.var(ddof=1)) / len(part), len(part) - 1) for part in means if len(part) > 1]


def _parts_of_seeds(first: NDArray[Any], second: NDArray[Any], are_trained: tuple[bool, bool]) -> list[_Part]:
    """Return the parts of two policies' seeds; a single training is taken to vary as those of the other policy do."""
    if all(are_trained) and min(len(first), len(second)) == 1 < max(len(first), len(second)):
        several = max(first, second, key=len)
        return [_Part(float(several.var(ddof=1)) * (1.0 / len(several) + 1.0), len(several) - 1)]
    return _parts(first, second)


def _error(parts: Sequence[_Part]) -> tuple[float, float]:
    """Return the standard error of a sum of means and its degrees of freedom; 0 and infinity where nothing varies."""
    total = sum(part.variance for part in parts)
    if total == 0.0:
        return 0.0, math.inf
    return math.sqrt(total), 1.0 / sum((part.variance / total) ** 2 / part.freedom for part in parts)


def _interval(estimate: float, error: float, freedom: float) -> Interval:
    reach = error * float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom)) if error else 0.0
    return Interval(estimate=estimate, low=estimate - reach, high=estimate + reach)


def _require_values(*arrays: NDArray[Any]) -> None:
    shapes = [np.shape(array) for array in arrays]
    require(all(len(shape) == 2 and min(shape) > 0 for shape in shapes), f"values are (seeds, scenes), not {shapes}")
    require(len({shape[1] for shape in shapes}) == 1, f"paired values are of the same scenes, not {shapes}")
