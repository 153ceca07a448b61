"""Pairwise covers."""

import math
from itertools import combinations, product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import ConfigurationError
from validation.soil.cover import pairwise_cover

_AXES = st.dictionaries(
    st.sampled_from(["azimuth", "cell", "step", "speed", "fidelity", "depth"]),
    st.lists(st.integers(0, 9), min_size=1, max_size=5, unique=True),
    min_size=2,
)


@given(_AXES)
def test_every_two_values_of_two_axes_meet_in_a_case(axes):
    cases = pairwise_cover(axes)
    for a, b in combinations(axes, 2):
        met = {(case[a], case[b]) for case in cases}
        assert met == set(product(axes[a], axes[b]))


@given(_AXES)
def test_a_cover_has_no_case_twice_and_never_more_than_all_combinations(axes):
    cases = pairwise_cover(axes)
    assert len({tuple(case.items()) for case in cases}) == len(cases) <= math.prod(map(len, axes.values()))


def test_a_cover_of_many_axes_is_far_smaller_than_all_combinations():
    axes = {name: range(4) for name in "abcdef"}
    assert len(pairwise_cover(axes)) <= 30 < 4**6


def test_the_first_case_has_the_first_values():
    assert pairwise_cover({"a": (1, 2), "b": "xy", "c": (0.1, 0.2)})[0] == {"a": 1, "b": "x", "c": 0.1}


@pytest.mark.parametrize("axes", [{}, {"a": (1, 2)}, {"a": (1,), "b": ()}])
def test_axes_without_pairs_are_refused(axes):
    with pytest.raises(ConfigurationError, match=r"axes=|no value"):
        pairwise_cover(axes)
