"""Intervals and tests for rates and means of few episodes."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from lerobot_excav.errors import require

CONFIDENCE = 0.95
RESAMPLES = 10_000


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate with the ends of its 95 % confidence interval."""

    estimate: float
    low: float
    high: float


def wilson_interval(successes: int, n: int) -> Interval:
    """Estimate a proportion with Wilson's score interval.

    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212. Unlike the textbook interval it is right for few episodes
    and for rates near 0 and 1.

    Raises:
        ConfigurationError: No trials `n`, or successes outside [0, n].
    """
    require(n >= 1, f"n={n}: a proportion needs at least one episode")
    require(0 <= successes <= n, f"successes={successes} is out of range; allowed: 0 to n={n}")
    p = successes / n
    ends = stats.binomtest(successes, n).proportion_ci(CONFIDENCE, method="wilson")
    # The ends are exact at p = 0 and p = 1; rounding must not push them past it.
    return Interval(estimate=p, low=min(p, float(ends.low)), high=max(p, float(ends.high)))


def bootstrap_mean(values: NDArray[Any], rng: np.random.Generator) -> Interval:
    """Estimate the mean of independent values, shape (n,), with a percentile bootstrap interval.

    Raises:
        ConfigurationError: No values.
    """
    return _bootstrap(np.mean, (values,), rng)


def bootstrap_ratio(numerator: NDArray[Any], denominator: NDArray[Any], rng: np.random.Generator) -> Interval:
    """Estimate the ratio of two means of paired values, each (n,), with a percentile bootstrap interval over scenes.

    Raises:
        ConfigurationError: Different lengths, no values, or a denominator without a positive mean.
    """
    _require_pairs(numerator, denominator)
    require(float(np.mean(denominator)) > 0.0, "the operator's mean is zero, so nothing can be related to it")
    return _bootstrap(_ratio_of_means, (numerator, denominator), rng)


def newcombe_interval(both: int, first_only: int, second_only: int, neither: int) -> Interval:
    """Estimate the difference `second - first` of two success rates on the same scenes with a 95 % score interval.

    Method 10 of R. G. Newcombe, Stat. Med. 17 (1998) 2635-2650: Wilson's intervals of the two rates, put together with
    regard to their correlation. Unlike a bootstrap it keeps its width where all scenes differ alike, or none does.

    Raises:
        ConfigurationError: No scenes, or a negative number of those on which both, only one, or neither succeeds.
    """
    counts = (both, first_only, second_only, neither)
    require(min(counts) >= 0, f"counts must not be negative: {counts}")
    n = sum(counts)
    first, second = wilson_interval(both + first_only, n), wilson_interval(both + second_only, n)
    return difference_of_rates(first, second, correlation=_cautious_correlation(*counts))


def difference_of_rates(first: Interval, second: Interval, *, correlation: float) -> Interval:
    """Put the intervals of two rates together to that of their difference `second - first`, as Newcombe does."""

    def together(a: float, b: float) -> float:
        return math.sqrt(max(0.0, a * a - 2.0 * correlation * a * b + b * b))

    difference = second.estimate - first.estimate
    below = together(second.estimate - second.low, first.high - first.estimate)
    above = together(second.high - second.estimate, first.estimate - first.low)
    return Interval(estimate=difference, low=max(-1.0, difference - below), high=min(1.0, difference + above))


def _cautious_correlation(both: float, first_only: float, second_only: float, neither: float) -> float:
    """Correlate two truth values, a positive correlation corrected for continuity; 0 where one never changes."""
    n = both + first_only + second_only + neither
    excess: float = both * neither - first_only * second_only
    if excess > 0:
        excess = max(0.0, excess - n / 2)
    firsts, seconds = both + first_only, both + second_only
    spread = math.sqrt(firsts * (n - firsts) * seconds * (n - seconds))
    return excess / spread if spread else 0.0


def cautious_correlation_of_rates(first: NDArray[Any], second: NDArray[Any]) -> float:
    """Correlate two rates, each (scenes,), corrected as that of truth values is, which are rates of one seed."""
    n = len(first)
    both, firsts, seconds = float(first @ second), float(first.sum()), float(second.sum())
    return _cautious_correlation(both, firsts - both, seconds - both, n - firsts - seconds + both)


def mcnemar_exact(first_only: int, second_only: int) -> float:
    """Return the p-value of equal success rates on the same scenes; 1 if they never differ.

    The exact, two-sided form: the scenes on which only one of the two succeeds fall to either side like a fair coin
    (Q. McNemar, Psychometrika 12 (1947) 153-157).
    """
    require(first_only >= 0 and second_only >= 0, f"counts must not be negative: {first_only}, {second_only}")
    n = first_only + second_only
    return float(stats.binomtest(first_only, n).pvalue) if n else 1.0


def _require_pairs(first: NDArray[Any], second: NDArray[Any]) -> None:
    require(
        np.shape(first) == np.shape(second),
        f"paired values are as many on both sides, not {np.size(first)} and {np.size(second)}",
    )


def _ratio_of_means(numerator: NDArray[Any], denominator: NDArray[Any], axis: int = -1) -> NDArray[Any]:
    """Divide means; a resample without anything in the denominator counts as infinite."""
    above, below = np.asarray(numerator.mean(axis=axis)), np.asarray(denominator.mean(axis=axis))
    ratios = np.full(below.shape, np.inf)
    np.divide(above, below, out=ratios, where=below > 0.0)
    return ratios


def _bootstrap(statistic: Callable[..., Any], samples: tuple[NDArray[Any], ...], rng: np.random.Generator) -> Interval:
    """Resample scenes, the same ones in every sample, and take the percentiles of the statistic."""
    samples = tuple(np.asarray(sample, dtype=np.float64) for sample in samples)
    require(samples[0].size >= 1, "a mean needs at least one episode")
    estimate = float(statistic(*samples, axis=-1))
    if samples[0].size == 1:  # every resample is the one scene
        return Interval(estimate=estimate, low=estimate, high=estimate)
    ends = stats.bootstrap(
        samples,
        statistic,
        paired=True,
        vectorized=True,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=rng,
    ).confidence_interval
    return Interval(estimate=estimate, low=float(ends.low), high=float(ends.high))
