import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation import statistics


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    [
        # R. G. Newcombe, Statistics in Medicine 17 (1998) 857-872, table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_interval_reproduces_published_values(successes, n, low, high):
    interval = statistics.wilson_interval(successes, n)
    assert interval.estimate == successes / n
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-5)


@given(n=st.integers(1, 400), share=st.floats(0, 1))
def test_wilson_interval_holds_the_estimate_and_mirrors(n, share):
    k = round(n * share)
    interval, mirrored = statistics.wilson_interval(k, n), statistics.wilson_interval(n - k, n)
    assert 0.0 <= interval.low <= interval.estimate <= interval.high <= 1.0
    assert interval.low == pytest.approx(1.0 - mirrored.high)


@pytest.mark.parametrize(("first", "second", "p"), [(0, 0, 1.0), (0, 5, 0.0625), (1, 9, 0.021484375), (5, 5, 1.0)])
def test_mcnemar_is_the_two_sided_binomial_test(first, second, p):
    assert statistics.mcnemar_exact(first, second) == pytest.approx(p)
    assert statistics.mcnemar_exact(second, first) == statistics.mcnemar_exact(first, second)


@pytest.mark.parametrize(
    ("counts", "low", "high"),
    [
        # D. G. Altman et al., Statistics with Confidence (2000), table 6.2 (R package biostatUZH has the same example).
        ((14, 5, 0, 22), 0.011, 0.226),
        # M. W. Fagerland et al., Statistical Analysis of Contingency Tables (2017), chapter 8: two trials.
        ((1, 1, 7, 12), -0.507, -0.026),
        ((59, 6, 16, 80), -0.119, -0.005),
    ],
)
def test_newcombe_interval_reproduces_published_values(counts, low, high):
    both, here, there, neither = counts  # published as here minus there
    interval = statistics.newcombe_interval(both, there, here, neither)
    assert interval.estimate == pytest.approx((here - there) / sum(counts))
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-4)


@pytest.mark.parametrize("n", [1, 4, 50])
def test_a_difference_of_all_scenes_is_as_uncertain_as_the_rates_themselves(n):
    wilson = statistics.wilson_interval(n, n)
    interval = statistics.newcombe_interval(0, 0, n, 0)
    assert (interval.estimate, interval.high) == (1.0, 1.0)
    assert interval.low == pytest.approx(max(-1.0, 1.0 - math.sqrt(2.0) * (1.0 - wilson.low)))


@pytest.mark.parametrize("counts", [(50, 0, 0, 0), (0, 0, 0, 50), (25, 0, 0, 25), (1, 0, 0, 0)])
def test_runs_that_never_differ_are_not_certain_to_be_equal(counts):
    interval = statistics.newcombe_interval(*counts)
    assert interval.low == pytest.approx(-interval.high)
    assert interval.low < -0.03 < interval.estimate == 0.0


@given(counts=st.tuples(*4 * [st.integers(0, 60)]).filter(any))
def test_newcombe_interval_holds_the_estimate_and_mirrors(counts):
    both, first_only, second_only, neither = counts
    interval, mirrored = (
        statistics.newcombe_interval(*counts),
        statistics.newcombe_interval(both, second_only, first_only, neither),
    )
    assert -1.0 <= interval.low <= interval.estimate <= interval.high <= 1.0
    assert interval.low < interval.high
    assert interval.low == pytest.approx(-mirrored.high)


def test_bootstrap_of_a_mean_agrees_with_the_normal_interval_for_many_values(rng):
    values = rng.normal(10.0, 2.0, 2000)
    interval = statistics.bootstrap_mean(values, rng)
    mean, half = values.mean(), 1.96 * values.std() / math.sqrt(values.size)
    assert interval.estimate == pytest.approx(mean)
    # The ends of 10 000 resamples scatter by a few percent of the half width.
    assert (interval.low, interval.high) == pytest.approx((mean - half, mean + half), abs=0.1 * half)


def test_the_same_seed_gives_the_same_interval():
    values = np.arange(10.0) ** 1.5
    first, second = (statistics.bootstrap_mean(values, np.random.default_rng(3)) for _ in range(2))
    assert first == second
    assert first != statistics.bootstrap_mean(values, np.random.default_rng(4))


SCENES = np.array([100.0, 200.0, 400.0, 150.0])


@pytest.mark.parametrize(
    ("estimate", "values", "exact"),
    [
        (statistics.bootstrap_mean, [np.full(7, 3.0)], 3.0),
        (statistics.bootstrap_ratio, [0.8 * SCENES, SCENES], 0.8),
    ],
)
def test_what_is_the_same_on_all_scenes_has_no_spread(estimate, values, exact, rng):
    interval = estimate(*values, rng)
    assert (interval.low, interval.estimate, interval.high) == pytest.approx((exact, exact, exact))


@pytest.mark.parametrize(
    "call",
    [
        lambda rng: statistics.wilson_interval(0, 0),
        lambda rng: statistics.wilson_interval(3, 2),
        lambda rng: statistics.bootstrap_mean(np.array([]), rng),
        lambda rng: statistics.bootstrap_ratio(np.ones(2), np.ones(3), rng),
        lambda rng: statistics.bootstrap_ratio(np.ones(2), np.zeros(2), rng),
        lambda rng: statistics.mcnemar_exact(-1, 2),
        lambda rng: statistics.newcombe_interval(0, 0, 0, 0),
        lambda rng: statistics.newcombe_interval(5, -1, 2, 0),
    ],
)
def test_impossible_inputs_are_refused(call, rng):
    with pytest.raises(ConfigurationError):
        call(rng)
