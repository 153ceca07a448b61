"""Means and differences over seeds and scenes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.seed_bootstrap import difference_over_seeds, holm, mean_over_seeds, ratio_over_seeds


def coverage(truth, draw, estimate, *, trials=200):
    """Return how often an interval of drawn values holds the truth."""
    rng = np.random.default_rng(0)
    intervals = [estimate(draw(rng), rng) for _ in range(trials)]
    return np.mean([interval.low <= truth <= interval.high for interval in intervals])


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    monkeypatch.setattr("lerobot_excav.evaluation.seed_bootstrap.RESAMPLES", 1000)


def test_one_seed_is_the_bootstrap_over_scenes():
    values = np.random.default_rng(1).normal(50.0, 10.0, 40)
    mine = mean_over_seeds(values[None], np.random.default_rng(2))
    theirs = stats.bootstrap((values,), np.mean, method="percentile", rng=np.random.default_rng(3)).confidence_interval
    assert mine.estimate == pytest.approx(values.mean())
    assert (mine.low, mine.high) == pytest.approx((theirs.low, theirs.high), abs=0.6)


def test_an_interval_over_scenes_alone_would_be_too_sure_where_trainings_differ():
    def draw(rng):
        return rng.normal(0.0, 1.0, (8, 1)) + rng.normal(0.0, 1.0, (1, 30)) + rng.normal(0.0, 0.5, (8, 30))

    with_seeds = coverage(0.0, draw, mean_over_seeds)
    without = coverage(0.0, lambda rng: draw(rng).mean(axis=0)[None], mean_over_seeds)
    assert with_seeds > 0.85
    assert without < 0.7


def test_a_ratio_relates_to_the_same_scenes():
    reference = np.random.default_rng(4).uniform(200.0, 600.0, 50)
    ratio = ratio_over_seeds(0.8 * np.stack([reference, reference]), reference, np.random.default_rng(5))
    assert (ratio.estimate, ratio.low, ratio.high) == pytest.approx((0.8, 0.8, 0.8))


def test_a_difference_is_paired_by_scene():
    scenes = np.random.default_rng(6).normal(0.0, 100.0, 30)
    difference, p_value = difference_over_seeds(
        np.stack([scenes, scenes]), np.stack([scenes + 4.0, scenes + 6.0]), np.random.default_rng(7)
    )
    assert difference.estimate == pytest.approx(5.0)
    assert 4.0 <= difference.low <= difference.high <= 6.0 + 1e-9
    assert p_value == pytest.approx(2 / 1001)


def test_p_values_of_equal_methods_are_even():
    rng = np.random.default_rng(8)
    p_values = [difference_over_seeds(*rng.normal(size=(2, 1, 40)), rng)[1] for _ in range(200)]
    assert np.mean(np.array(p_values) < 0.05) < 0.12
    assert np.mean(np.array(p_values) < 0.5) == pytest.approx(0.5, abs=0.12)
    same = rng.normal(size=(1, 40))
    assert difference_over_seeds(same, same, rng)[1] == 1.0


def test_holm_is_as_in_a_textbook():
    # Four hypotheses of S. Holm's procedure: 0.005 x 4, 0.01 x 3, 0.03 x 2, and 0.04 raised to what stands before it.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_corrected_p_values_keep_their_order_and_are_no_smaller(p_values):
    corrected = holm(p_values)
    assert all(after >= before for before, after in zip(p_values, corrected, strict=True))
    order = np.argsort(p_values, kind="stable")
    assert np.all(np.diff(np.array(corrected)[order]) >= 0.0)


@pytest.mark.parametrize(
    ("function", "arrays"),
    [
        (mean_over_seeds, [np.zeros((0, 3))]),
        (mean_over_seeds, [np.zeros(3)]),
        (ratio_over_seeds, [np.ones((2, 3)), np.ones(4)]),
        (ratio_over_seeds, [np.ones((2, 3)), np.zeros(3)]),
        (difference_over_seeds, [np.ones((2, 3)), np.ones((2, 4))]),
    ],
)
def test_what_cannot_be_averaged_or_paired_is_refused(function, arrays):
    with pytest.raises(ConfigurationError):
        function(*arrays, np.random.default_rng(0))
