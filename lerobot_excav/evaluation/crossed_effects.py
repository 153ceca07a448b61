"""Means and differences over training seeds and scenes, both drawn from many that could have been.

Episodes of one training are not independent of each other, and neither are episodes on one scene. The variance of a
mean over S seeds and N scenes is taken as that of the seeds' means over S plus that of the scenes' means over N; what
is left of an episode's own variance counts in both, which errs on the wide side. Intervals and p-values are Student's,
and their degrees of freedom those of F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110-114: with three seeds that
differ much, they are as uncertain as three numbers are; in simulations, 95 % intervals of three seeds held the truth in
91 to 95 % of the cases. A single seed tells nothing of seeds: then all is said of that training.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from lerobot_excav.errors import require
from lerobot_excav.evaluation.statistics import CONFIDENCE, Interval


def mean_over_seeds(values: NDArray[Any]) -> Interval:
    """Estimate the mean of values (seeds, scenes).

    Raises:
        ConfigurationError: No values.
    """
    _require_values(values)
    return _interval(float(values.mean()), *_error(values.mean(axis=1), values.mean(axis=0)))


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
    return _interval(ratio, *_error(values.mean(axis=1) / scale, (values.mean(axis=0) - ratio * reference) / scale))


def difference_over_seeds(first: NDArray[Any], second: NDArray[Any]) -> tuple[Interval, float]:
    """Estimate `second - first`, each (its seeds, the same scenes), paired by scene; return it and its p-value.

    Raises:
        ConfigurationError: No values, or other scenes.
    """
    _require_values(first, second)
    by_scene = second.mean(axis=0) - first.mean(axis=0)
    estimate, (error, freedom) = float(by_scene.mean()), _error(first.mean(axis=1), second.mean(axis=1), by_scene)
    if error == 0.0:
        return _interval(estimate, error, freedom), 1.0 if estimate == 0.0 else 0.0
    p_value = 2.0 * float(stats.t.sf(abs(estimate) / error, freedom))
    return _interval(estimate, error, freedom), p_value


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number, in their order (S. Holm, Scand. J. Stat. 6 (1979) 65-70)."""
    order = np.argsort(p_values, kind="stable")
    corrected = np.empty(len(order))
    corrected[order] = np.maximum.accumulate(np.array(p_values)[order] * np.arange(len(order), 0, -1))
    return [float(value) for value in np.minimum(corrected, 1.0)]


def _error(*means: NDArray[Any]) -> tuple[float, float]:
    """Return the standard error of a sum of means, each of independent numbers, and its degrees of freedom."""
    known = [part for part in means if len(part) > 1]
    variances = np.array([part.var(ddof=1) / len(part) for part in known])
    total = float(variances.sum())
    if total == 0.0:
        return 0.0, math.inf
    shares = [(variance / total) ** 2 / (len(part) - 1) for variance, part in zip(variances, known, strict=True)]
    return math.sqrt(total), 1.0 / float(np.sum(shares))


def _interval(estimate: float, error: float, freedom: float) -> Interval:
    reach = error * float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom)) if error else 0.0
    return Interval(estimate=estimate, low=estimate - reach, high=estimate + reach)


def _require_values(*arrays: NDArray[Any]) -> None:
    shapes = [np.shape(array) for array in arrays]
    require(all(len(shape) == 2 and min(shape) > 0 for shape in shapes), f"values are (seeds, scenes), not {shapes}")
    require(len({shape[1] for shape in shapes}) == 1, f"paired values are of the same scenes, not {shapes}")
