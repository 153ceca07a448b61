"""Verdicts follow from how often a machine acts and from the interval of its slope."""

import pytest

from lerobot_excav.evaluation.audit.obedience import Obedience
from lerobot_excav.evaluation.audit.verdict import INSENSITIVE, OBEYS, OUT_OF_SUPPORT, PARTLY, UNDECIDED, judge
from lerobot_excav.evaluation.statistics import Interval


def found(low, slope, high, *, acted=1.0, compared_scenes=20):
    of_slope = Interval(estimate=slope, low=low, high=high)
    acted_share = Interval(estimate=acted, low=acted, high=acted)
    nothing = dict.fromkeys(("entry_error_m", "share", "relative_share"))
    return Obedience(
        scenes=20, compared_scenes=compared_scenes, branches=80, acted=acted_share, success=acted_share,
        slope=of_slope, **nothing,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("interval", "verdict", "words"),
    [
        ((0.9, 1.0, 1.1), OBEYS, "lies between 0.8 and 1.25"),
        ((0.3, 0.5, 0.7), PARTLY, "between 0.2 and 0.8"),
        ((-0.1, 0.0, 0.1), INSENSITIVE, "below 0.2"),
        ((0.1, 0.6, 1.1), UNDECIDED, "more than one verdict"),
        ((1.3, 1.4, 1.5), UNDECIDED, "goes further than the masks do"),
    ],
)
def test_the_interval_of_the_slope_decides(interval, verdict, words):
    judged = judge(found(*interval))
    assert judged.verdict == verdict
    assert words in judged.reason


def test_who_seldom_acts_is_out_of_support():
    assert judge(found(0.9, 1.0, 1.1, acted=0.4)).verdict == OUT_OF_SUPPORT


def test_scenes_without_two_places_to_compare_do_not_count():
    judged = judge(found(0.9, 1.0, 1.1, compared_scenes=3))
    assert judged.verdict == UNDECIDED
    assert judged.reason.startswith("3 scenes with at least two masks to act on")
