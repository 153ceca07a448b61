"""Means and differences over training seeds and scenes: both are drawn again, so that neither is taken for certain.

Episodes of one training are not independent of each other, and episodes on one scene are not either. So a resample
draws seeds with replacement and, for all of them together, scenes with replacement (crossed bootstrap; A. B. Owen,
Ann. Appl. Stat. 1 (2007) 386-411). With few seeds its intervals are still somewhat narrow.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.errors import require
from lerobot_excav.evaluation.statistics import CONFIDENCE, RESAMPLES, Interval


def mean_over_seeds(values: NDArray[Any], rng: np.random.Generator) -> Interval:
    """Estimate the mean of values (seeds, scenes) with a percentile interval.

    Raises:
        ConfigurationError: No values.
    """
    _require_values(values)
    return _interval(float(values.mean()), _resampled_means(values, _draws(values.shape[1], rng), rng))


def ratio_over_seeds(values: NDArray[Any], reference: NDArray[Any], rng: np.random.Generator) -> Interval:
    """Estimate the mean of values (seeds, scenes) over that of a reference (scenes,), which knows no seeds.

    Raises:
        ConfigurationError: No values, other scenes, or a reference without a positive mean.
    """
    _require_values(values, reference[None])
    require(float(reference.mean()) > 0.0, "the operator's mean is zero, so nothing can be related to it")
    scenes = _draws(values.shape[1], rng)
    below = reference[scenes].mean(axis=1)
    ratios = np.full(below.shape, np.inf)
    np.divide(_resampled_means(values, scenes, rng), below, out=ratios, where=below > 0.0)
    return _interval(float(values.mean() / reference.mean()), ratios)


def difference_over_seeds(
    first: NDArray[Any], second: NDArray[Any], rng: np.random.Generator
) -> tuple[Interval, float]:
    """Estimate `second - first`, each (its seeds, the same scenes), with a percentile interval and a p-value.

    The p-value is two-sided: twice the share of resamples on the other side of zero, never below 2 / (resamples + 1).

    Raises:
        ConfigurationError: No values, or other scenes.
    """
    _require_values(first, second)
    scenes = _draws(first.shape[1], rng)
    found = _resampled_means(second, scenes, rng) - _resampled_means(first, scenes, rng)
    beyond = 1 + min(int((found <= 0.0).sum()), int((found >= 0.0).sum()))
    p_value = min(1.0, 2.0 * beyond / (len(found) + 1))
    return _interval(float(second.mean() - first.mean()), found), p_value


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number, in their order (S. Holm, Scand. J. Stat. 6 (1979) 65-70)."""
    order = np.argsort(p_values, kind="stable")
    corrected = np.empty(len(order))
    corrected[order] = np.maximum.accumulate(np.array(p_values)[order] * np.arange(len(order), 0, -1))
    return [float(value) for value in np.minimum(corrected, 1.0)]


def _draws(scenes: int, rng: np.random.Generator) -> NDArray[Any]:
    return rng.integers(scenes, size=(RESAMPLES, scenes))


def _resampled_means(values: NDArray[Any], scenes: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    """Return the means (resamples,) of values over drawn scenes (resamples, n), and over seeds that are drawn here."""
    values = np.asarray(values, dtype=np.float64)
    seed_count = len(values)
    weights = rng.multinomial(seed_count, np.full(seed_count, 1.0 / seed_count), size=RESAMPLES) / seed_count
    means_by_seed = np.stack([row[scenes].mean(axis=1) for row in values], axis=1)
    return np.asarray((weights * means_by_seed).sum(axis=1))


def _interval(estimate: float, resampled: NDArray[Any]) -> Interval:
    outside = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(resampled, [outside, 100.0 - outside])
    return Interval(estimate=estimate, low=float(low), high=float(high))


def _require_values(*arrays: NDArray[Any]) -> None:
    shapes = [np.shape(array) for array in arrays]
    require(all(len(shape) == 2 and min(shape) > 0 for shape in shapes), f"values are (seeds, scenes), not {shapes}")
    require(len({shape[1] for shape in shapes}) == 1, f"paired values are of the same scenes, not {shapes}")
