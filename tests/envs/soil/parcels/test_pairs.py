from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.dynamics import press_pairs
from lerobot_excav.envs.soil.parcels.pairs import SKIN, enlarged, find_pairs, is_outdated, room_for
from validation.soil.reference import pairs as reference
from validation.soil.reference.worlds import DT, LAWS, RADIUS, make_state, random_state


def listed(pairs, count):
    return [(i, int(pairs.partner[k])) for i in range(count) for k in range(pairs.start[i], pairs.start[i + 1])]


def first_list(state, room=None):
    count = len(state.masses)
    none = np.full(count, -1, dtype=np.int64)
    return find_pairs(state.positions, state.radii, state.asleep, room_for(count), none, room or room_for(count))


@given(seed=st.integers(0, 2**16), count=st.integers(1, 40), size=st.sampled_from([0.1, 0.3, 1.0, 4.0]))
@settings(max_examples=60)
def test_all_neighbours_are_listed_once_and_no_others(seed, count, size):
    rng = np.random.default_rng(seed)
    state = random_state(rng, count, size, centre=rng.uniform(-30.0, 30.0, 3))
    state.asleep[:] = rng.random(count) < 0.4
    found = listed(first_list(state), count)
    assert len(found) == len(set(found))
    assert set(found) == reference.neighbours(state.positions, state.radii, state.asleep)


def test_parcels_whose_cells_have_the_same_number_are_no_neighbours():
    cell = (2.0 + SKIN) * RADIUS
    far = cell * np.array([[32.0, 0.0, 0.0], [0.0, 32.0, 0.0], [0.0, 0.0, 16.0], [-64.0, 32.0, 16.0]])
    state = make_state(np.concatenate([np.zeros((1, 3)), far]))
    assert listed(first_list(state), 5) == []


def test_a_crowd_gets_the_room_that_it_needs():
    """200 parcels at one point are 19,900 pairs, where there is room for 16 per parcel."""
    state = make_state(np.zeros((200, 3)))
    pairs = first_list(state)
    assert len(listed(pairs, 200)) == 199 * 100
    assert len(pairs.partner) == len(pairs.closed) == len(pairs.springs) == len(pairs.first)


@given(seed=st.integers(0, 2**16))
@settings(max_examples=60)
def test_pair_forces_are_those_of_every_parcel_against_every_other(seed):
    rng = np.random.default_rng(seed)
    state = random_state(rng, 12, 0.12)
    state.asleep[:] = rng.random(12) < 0.3
    state.load[:] = rng.random(12) < 0.5
    twin, memory = deepcopy(state), {}
    pairs, pushes, expected_pushes = first_list(state), np.zeros(6), np.zeros(6)
    for _ in range(4):  # contacts open and close while the parcels are shaken
        shaken = rng.normal(0.0, 0.1 * SKIN * RADIUS, (12, 3))
        for s in (state, twin):
            s.positions[:] += np.clip(shaken, -0.12 * SKIN * RADIUS, 0.12 * SKIN * RADIUS)
            s.forces[:] = 0.0
            s.torques[:] = 0.0
        hit = press_pairs(state, pairs, LAWS.parcel, DT, pushes)
        expected = reference.press_pairs(twin, memory, LAWS.parcel, DT, expected_pushes)
        awake = state.asleep == 0
        np.testing.assert_allclose(state.forces[awake], twin.forces[awake], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(state.torques[awake], twin.torques[awake], rtol=1e-9, atol=1e-9)
        assert hit == pytest.approx(expected, abs=1e-12)
        np.testing.assert_allclose(pushes, expected_pushes, rtol=1e-9, atol=1e-9)
    kept = {(i, j): pairs.springs[k] for k, (i, j) in enumerate(listed(pairs, 12)) if pairs.closed[k]}
    assert set(kept) == set(memory)
    for pair, springs in memory.items():
        np.testing.assert_allclose(kept[pair], springs, rtol=1e-9, atol=1e-12)


@given(seed=st.integers(0, 2**16), capacity=st.sampled_from([23, 200]))
@settings(max_examples=60)
def test_memory_survives_a_new_list_in_which_parcels_left_and_joined(seed, capacity):
    """Also one with more room."""
    rng = np.random.default_rng(seed)
    state = random_state(rng, 20, 0.15)
    pairs = first_list(state)
    names = listed(pairs, 20)
    pairs.closed[: len(names)] = 1
    pairs.springs[: len(names)] = rng.normal(0.0, 1.0, (len(names), 6))
    memory = {name: pairs.springs[k].copy() for k, name in enumerate(names)}
    stayed = np.flatnonzero(rng.random(20) < 0.7)
    old_rows = np.concatenate([stayed, [-1, -1, -1]]).astype(np.int64)
    changed = make_state(np.concatenate([state.positions[stayed], rng.uniform(-0.15, 0.15, (3, 3))]))
    changed.radii[: len(stayed)] = state.radii[stayed]
    changed.radii[len(stayed) :] = state.radii.max()
    count = len(old_rows)
    room = enlarged(pairs, capacity), old_rows, room_for(capacity)
    new = find_pairs(changed.positions, changed.radii, changed.asleep, *room)
    for k, (i, j) in enumerate(listed(new, count)):
        old = memory.get((int(old_rows[i]), int(old_rows[j])))
        if i < len(stayed) and j < len(stayed) and old is not None:
            assert new.closed[k] == 1
            np.testing.assert_array_equal(new.springs[k], old)
        else:
            assert new.closed[k] == 0
            assert not new.springs[k].any()


@given(seed=st.integers(0, 2**16), step=st.floats(0.0, 0.5), wind=st.floats(-10.0, 10.0))
@settings(max_examples=80)
def test_no_unlisted_parcels_touch_as_long_as_the_list_is_not_outdated(seed, step, wind):
    rng = np.random.default_rng(seed)
    state = random_state(rng, 25, 0.25)
    pairs = first_list(state)
    known = set(listed(pairs, 25))
    state.positions[:] += wind + rng.uniform(-1.0, 1.0, (25, 3)) * step * RADIUS
    if is_outdated(state.positions, state.radii, pairs.anchors):
        return
    apart = np.linalg.norm(state.positions[:, None] - state.positions[None], axis=2)
    for i, j in np.argwhere(apart < state.radii[:, None] + state.radii[None]):
        assert i >= j or (i, j) in known


def test_a_list_stays_valid_while_all_parcels_move_together():
    state = make_state([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    pairs = first_list(state)
    state.positions[:] += 5.0
    assert not is_outdated(state.positions, state.radii, pairs.anchors)
    state.positions[1, 0] += 2.1 * 0.5 * SKIN * RADIUS
    assert is_outdated(state.positions, state.radii, pairs.anchors)
