"""Means and differences over seeds and scenes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.crossed_effects import difference_over_seeds, holm, mean_over_seeds, ratio_over_seeds


def drawn(rng, seeds=3, scenes=30, *, by_seed=1.0, by_scene=1.0, rest=1.0):
    """Draw values whose mean is zero: of seeds, of scenes, and of every episode."""
    of_seeds = rng.normal(0.0, by_seed, (seeds, 1))
    return of_seeds + rng.normal(0.0, by_scene, (1, scenes)) + rng.normal(0.0, rest, (seeds, scenes))


@pytest.mark.parametrize(("by_seed", "by_scene"), [(1.0, 0.1), (0.1, 1.0), (0.5, 2.0), (0.0, 0.0)])
def test_an_interval_of_three_trainings_holds_the_truth_in_nine_cases_of_ten(by_seed, by_scene):
    rng = np.random.default_rng(0)
    intervals = [mean_over_seeds(drawn(rng, by_seed=by_seed, by_scene=by_scene)) for _ in range(600)]
    assert np.mean([interval.low <= 0.0 <= interval.high for interval in intervals]) > 0.9


def test_three_trainings_that_differ_are_no_proof_however_many_scenes_they_play():
    rng = np.random.default_rng(1)
    p_values = []
    for _ in range(600):
        scenes = rng.normal(0.0, 1.0, (1, 100))
        first, second = (scenes + drawn(rng, scenes=100, by_seed=2.0, by_scene=0.0, rest=0.3) for _ in range(2))
        p_values.append(difference_over_seeds(first, second)[1])
    assert np.mean(np.array(p_values) < 0.05) < 0.07
    assert np.mean(np.array(p_values) < 0.001) < 0.01


def test_a_clear_difference_of_three_trainings_is_found():
    rng = np.random.default_rng(2)
    first = 27.0 + drawn(rng, by_seed=3.0, by_scene=6.0, rest=3.0)
    second = 77.0 + drawn(rng, by_seed=3.0, by_scene=6.0, rest=3.0)
    difference, p_value = difference_over_seeds(first, second)
    assert p_value < 0.001
    assert difference.low < 50.0 < difference.high


@pytest.mark.parametrize("seeds", [(1, 3), (3, 1), (1, 5)])
def test_a_single_training_varies_as_those_do_with_which_it_is_compared(seeds):
    rng, p_values, held = np.random.default_rng(6), [], []
    for _ in range(600):
        scenes = rng.normal(0.0, 1.0, (1, 40))
        first, second = (scenes + drawn(rng, n, 40, by_seed=2.0, by_scene=0.0, rest=0.3) for n in seeds)
        difference, p_value = difference_over_seeds(first, second)
        p_values.append(p_value)
        held.append(difference.low <= 0.0 <= difference.high)
    assert np.mean(np.array(p_values) < 0.05) < 0.07
    assert np.mean(held) > 0.93


def test_an_operator_has_no_seeds_that_could_vary():
    rng = np.random.default_rng(7)
    policy, operator = drawn(rng, seeds=3, by_seed=2.0), drawn(rng, seeds=1, by_seed=0.0)
    (trained, _), (fixed, _) = (
        difference_over_seeds(operator, policy, are_trained=(is_trained, True)) for is_trained in (True, False)
    )
    assert trained.estimate == fixed.estimate
    assert fixed.high - fixed.low < 0.6 * (trained.high - trained.low)


def test_a_single_scene_of_single_trainings_tells_nothing():
    difference, p_value = difference_over_seeds(np.array([[70.0]]), np.array([[80.0]]))
    assert (difference.low, difference.estimate, difference.high, p_value) == (10.0, 10.0, 10.0, None)


def test_of_single_trainings_it_is_the_paired_t_test():
    first, second = np.random.default_rng(3).normal(0.0, 1.0, (2, 1, 25))
    difference, p_value = difference_over_seeds(first, second + 0.3)
    known = stats.ttest_rel(second[0] + 0.3, first[0])
    assert p_value == pytest.approx(known.pvalue)
    ends = known.confidence_interval(0.95)
    assert (difference.low, difference.high) == pytest.approx((ends.low, ends.high))


def test_a_ratio_relates_to_the_same_scenes():
    reference = np.random.default_rng(4).uniform(200.0, 600.0, 50)
    exact = ratio_over_seeds(0.8 * np.stack([reference, reference]), reference)
    assert (exact.estimate, exact.low, exact.high) == pytest.approx((0.8, 0.8, 0.8))
    rng, held = np.random.default_rng(5), []
    for _ in range(400):
        theirs = rng.uniform(200.0, 600.0, 50)
        mine = (0.8 + rng.normal(0.0, 0.05, (3, 1))) * theirs + rng.normal(0.0, 30.0, (3, 50))
        ratio = ratio_over_seeds(mine, theirs)
        held.append(ratio.low <= 0.8 <= ratio.high)
    assert np.mean(held) > 0.88


def test_equal_values_have_no_width_and_no_doubt():
    same = np.ones((3, 20))
    assert mean_over_seeds(same) == mean_over_seeds(np.ones((1, 20)))
    assert mean_over_seeds(same).low == mean_over_seeds(same).high == 1.0
    assert difference_over_seeds(same, same)[1] == 1.0
    assert difference_over_seeds(same, 2.0 * same)[1] == 0.0


def test_holm_is_as_in_a_textbook():
    # Four hypotheses of S. Holm's procedure: 0.005 x 4, 0.01 x 3, 0.03 x 2, and 0.04 raised to what stands before it.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


def test_comparisons_that_are_not_made_yet_count_as_the_largest():
    assert holm([0.01, 0.03], family=4) == pytest.approx([0.04, 0.09])
    assert holm([0.02], family=5) == pytest.approx([0.1])
    with pytest.raises(ConfigurationError, match="family=1 is less"):
        holm([0.1, 0.2], family=1)


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
        function(*arrays)
