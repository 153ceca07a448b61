from copy import deepcopy

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.store import copy_rows, empty_state, keep, rows


def filled(rng, count):
    """Return a state with other numbers in every place."""
    state = empty_state(count, 5)
    for array in state:
        array[:] = rng.integers(0, 200, array.shape)
    return state


@given(kept=st.lists(st.booleans(), min_size=1, max_size=30), seed=st.integers(0, 99))
@settings(max_examples=60)
def test_kept_rows_move_to_the_front_in_their_order_with_all_they_have(kept, seed):
    state, mask = filled(np.random.default_rng(seed), len(kept)), np.array(kept)
    before = deepcopy(state)
    assert keep(state, mask) == mask.sum()
    for now, old in zip(rows(state, mask.sum()), before, strict=True):
        np.testing.assert_array_equal(now, old[mask])


def test_rows_are_views_and_copies_are_not(rng):
    state, target = filled(rng, 3), empty_state(6, 5)
    copy_rows(state, target)
    view = rows(target, 3)
    for a, b in zip(state, view, strict=True):
        np.testing.assert_array_equal(a, b)
    state.masses[0] = -1.0
    view.masses[1] = -2.0
    assert view.masses[0] != -1.0
    assert target.masses[1] == -2.0
