import numpy as np
import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.comparison import compare, matched


def test_differences_are_paired_by_scene_and_target(make_run, scoop_line):
    first = make_run("a", [scoop_line(i, target_success=i < 2, retained_mass_kg=100.0 * i) for i in range(8)])
    # The same scenes in another order, each 7 kg better.
    better = [scoop_line(i, episode_ix=7 - i, retained_mass_kg=100.0 * i + 7) for i in reversed(range(8))]
    second = make_run("b", better)
    target, full, mass = compare(first, second)
    assert target.difference.estimate == pytest.approx(0.75)
    assert target.p_value == pytest.approx(2 / 2**6)
    assert full.p_value == 1.0
    assert (mass.difference.low, mass.difference.high) == pytest.approx((7.0, 7.0))
    assert mass.p_value < 0.001
    assert [change.p_corrected for change in (target, full, mass)] == [None] * 3


def test_several_seeds_may_differ_as_scenes_do(make_run, scoop_line):
    scenes = range(20)
    first = make_run("a", *([scoop_line(i) for i in scenes] for _ in range(2)))
    second = make_run("b", [scoop_line(i) for i in scenes], [scoop_line(i, target_success=False) for i in scenes])
    target, *_ = compare(first, second)
    assert target.difference.estimate == -0.5
    # One of two trainings misses always: a third may do either.
    assert target.difference.low == -1.0
    assert target.difference.high > 0.0
    assert target.p_value > 0.4


def test_several_trainings_that_all_succeed_are_not_beyond_doubt(make_run, scoop_line):
    scenes = range(6)
    first = make_run("a", *([scoop_line(i) for i in scenes] for _ in range(3)))
    second = make_run("b", *([scoop_line(i, target_success=False) for i in scenes] for _ in range(3)))
    target, *_ = compare(first, second)
    assert target.difference.estimate == -1.0
    assert target.difference.high > -0.7
    assert target.p_value == pytest.approx(2 / 2**6)


def hits(scoop_line, outcomes):
    return [scoop_line(scene, target_success=bool(hit)) for scene, hit in enumerate(outcomes)]


def test_rates_of_three_trainings_that_clearly_differ_are_told_apart(make_run, scoop_line):
    """A tenth of the scoops misses, in other scenes by each training: a majority hits everywhere."""
    scenes = np.arange(50)
    first = make_run("a", *(hits(scoop_line, scenes >= 0) for _ in range(3)))
    second = make_run("b", *(hits(scoop_line, (scenes + seed) % 10 > 0) for seed in range(3)))
    target, *_ = compare(first, second)
    assert target.difference.estimate == pytest.approx(-0.1)
    assert target.difference.high < 0.0
    assert target.p_value < 0.01


def test_equal_rates_differ_by_nothing_whatever_the_number_of_trainings(make_run, scoop_line):
    scenes = np.arange(50)
    runs = [
        make_run(f"{seeds} seeds", *(hits(scoop_line, (scenes + 3 * seed) % 10 > 0) for seed in range(seeds)))
        for seeds in (2, 3)
    ]
    target, *_ = compare(*runs)
    assert target.difference.estimate == pytest.approx(0.0)
    assert -0.2 < target.difference.low < 0.0 < target.difference.high < 0.2
    assert target.difference.low == pytest.approx(-target.difference.high, abs=0.01)
    assert target.p_value > 0.5


def test_runs_that_end_alike_are_no_closer_than_their_scenes_allow(make_run, scoop_line):
    """As wide as of a single training each, whose interval is Newcombe's."""
    outcomes = np.arange(50) % 2 == 0
    widths = []
    for seeds in (1, 3):
        runs = [make_run(f"{name}{seeds}", *(hits(scoop_line, outcomes) for _ in range(seeds))) for name in "ab"]
        difference = compare(*runs)[0].difference
        widths.append(difference.high - difference.low)
    assert widths[1] >= 0.99 * widths[0] > 0.0


def test_a_difference_in_few_scenes_is_no_surer_than_they_allow(make_run, scoop_line):
    first = make_run("a", *(hits(scoop_line, np.ones(6)) for _ in range(3)))
    second = make_run("b", hits(scoop_line, [0, 0, 0, 0, 0, 1]), *(hits(scoop_line, np.zeros(6)) for _ in range(2)))
    target, *_ = compare(first, second)
    assert target.p_value >= 2 / 2**6
    assert target.difference.high > -0.8


def test_runs_on_other_scenes_are_not_compared(make_run, scoop_line):
    with pytest.raises(DatasetError, match=r"a and b differ in 2 scenes and targets \(test/1/0/1, test/2/0/2"):
        compare(make_run("a", [scoop_line(1)]), make_run("b", [scoop_line(2)]))


def test_the_operator_may_have_played_more_scenes_but_not_fewer(make_run, scoop_line):
    operator = make_run("o", [scoop_line(i, retained_mass_kg=float(i)) for i in range(1, 5)])
    policy = make_run("a", [scoop_line(3), scoop_line(2, episode_ix=4)])
    assert matched(policy, operator, "retained_mass_kg").tolist() == [2.0, 3.0]
    with pytest.raises(DatasetError, match="lacks 1 scenes"):
        matched(make_run("b", [scoop_line(9)]), operator, "retained_mass_kg")
