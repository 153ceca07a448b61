import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET
from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.parcels.dynamics import WAKING_SPEED_M_S
from lerobot_excav.envs.soil.parcels.load import (
    LARGEST_HEAP_M,
    LEAVING_M_S,
    RESTING_SPEED_M_S,
    RESTING_TIME_S,
    WAKING_TILT_RAD,
    Rest,
    find_load,
    places_in,
    put_to_sleep,
)
from lerobot_excav.envs.soil.parcels.store import TOUCHES_GROUND
from validation.soil.reference.load import is_load

RADIUS = 0.045
MASS = 0.94
HALF = 0.5 * BUCKET.inner_width_m
CARRY = math.pi
IN_BUCKET = (0.6, 0.0, 0.25)


@given(seed=st.integers(0, 2**16), pitch=st.floats(-3.2, 3.2), moves=st.booleans())
@settings(max_examples=60)
def test_the_load_is_that_of_the_reference(random_state, tool_path, seed, pitch, moves):
    rng = np.random.default_rng(seed)
    travel, turn = ([0.02, 0.01, 0.01], 0.02) if moves else ([0.0, 0.0, 0.0], 0.0)
    tool = tool_path((0.3, -0.1, 1.0), pitch, travel, turn, steps=20)
    near = tool.positions[-1] + tool.rotations[-1] @ [0.6, 0.0, 0.1]
    state = random_state(rng, 40, [0.8, 0.6, 0.6], centre=near)
    state.velocities[:] *= rng.choice([0.1, 1.0])
    state.ground[:] = TOUCHES_GROUND * (rng.random(40) < 0.02)
    mass, square_speed, _, touching = find_load(state, tool)
    expected = np.array(
        [is_load(tool, p, v, r) for p, v, r in zip(state.positions, state.velocities, state.radii, strict=True)]
    )
    np.testing.assert_array_equal(state.load == 1, expected)
    assert mass == pytest.approx(state.masses[expected].sum())
    arms = state.positions - tool.positions[-1]
    relative = state.velocities - tool.linear - np.cross(tool.angular, arms)
    kinetic = (state.masses * (relative**2).sum(axis=1))[expected].sum()
    assert square_speed * mass == pytest.approx(kinetic)
    assert bool(touching) == bool((expected & (state.ground == TOUCHES_GROUND)).any())


@pytest.mark.parametrize(
    ("point_t", "is_carried"),
    [
        (IN_BUCKET, True),
        ((0.6, 0.0, 0.02), True),
        ((0.6, 0.0, -0.1), True),  # in the heap above the opening
        ((0.6, 0.0, -LARGEST_HEAP_M - 0.01), False),
        ((1.15 + 0.5 * RADIUS, 0.0, -0.04), True),  # on the cutting edge
        ((1.15 + 1.5 * RADIUS, 0.0, -0.04), False),
        ((0.6, HALF + 0.5 * RADIUS, -0.04), True),  # on a side plate
        ((0.6, HALF + 1.5 * RADIUS, -0.04), False),
        ((0.6, HALF + 0.5 * RADIUS, 0.1), False),  # beside it
        ((0.6, 0.0, 0.7), False),  # under the carried bucket
    ],
)
def test_what_a_carried_bucket_holds(make_state, tool_path, point_t, is_carried):
    tool = tool_path(pitch=CARRY)
    state = make_state([tool.rotations[0] @ point_t])
    find_load(state, tool)
    assert bool(state.load[0]) == is_carried


def test_there_is_no_heap_over_an_opening_that_looks_to_the_side_nor_of_what_flies_by(make_state, tool_path):
    above = (0.6, 0.0, -0.1)
    sideways, level = tool_path(pitch=-math.pi / 2), tool_path(pitch=CARRY)
    state = make_state([sideways.rotations[0] @ above])
    find_load(state, sideways)
    assert state.load[0] == 0
    state = make_state([level.rotations[0] @ above], velocities=[[0.0, 0.0, -1.1 * LEAVING_M_S]])
    find_load(state, level)
    assert state.load[0] == 0


def test_sleeping_parcels_stay_load_and_do_not_count_as_awake_load(make_state, tool_path):
    tool = tool_path(pitch=CARRY)
    state = make_state([tool.rotations[0] @ IN_BUCKET] * 2, load=[1, 0], asleep=[1, 0])
    mass, _, _, _ = find_load(state, tool)
    assert mass == pytest.approx(MASS)
    np.testing.assert_array_equal(state.load, [1, 1])


def test_parcels_put_to_sleep_keep_their_place_in_the_bucket_and_forget_their_contacts(make_state, tool_path):
    tool = tool_path((0.5, 0.2, 1.0), -2.8)
    state = make_state(tool.positions[0] + np.array([IN_BUCKET, (0.5, 0.1, 0.3), (0.0, 0.0, 2.0)]))
    state.load[:] = [1, 1, 0]
    state.plate_springs[:] = 1.0
    state.ground_springs[:] = 1.0
    put_to_sleep(state, tool)
    np.testing.assert_array_equal(state.asleep, [1, 1, 0])
    back = tool.positions[0] + state.places_t[:2] @ tool.rotations[0].T
    np.testing.assert_allclose(back, state.positions[:2], atol=1e-12)
    np.testing.assert_allclose(state.places_t[:2], places_in(tool.positions[0], tool.rotations[0], state.positions[:2]))
    assert not state.plate_springs[:2].any()
    assert not state.ground_springs[:2].any()
    assert state.plate_springs[2].all()


def loaded(make_state, tool, **arrays):
    """Return three parcels in a bucket."""
    places = np.array([IN_BUCKET, (0.5, 0.1, 0.3), (0.7, -0.1, 0.2)])
    return make_state(tool.positions[-1] + places @ tool.rotations[-1].T, **arrays)


def asleep_in(make_state, tool):
    """Return a load that has just fallen asleep."""
    state, rest = loaded(make_state, tool, velocities=tool.linear), Rest()
    for _ in range(100):
        rest.update(state, tool, TICK_S, 0.0, cutting=False)
        if state.asleep.all():
            return state, rest
    raise AssertionError("the load does not sleep")


def test_a_load_at_rest_falls_asleep_after_the_resting_time(make_state, tool_path):
    tool = tool_path(pitch=CARRY)
    state, rest = loaded(make_state, tool), Rest()
    ticks = 0
    while not state.asleep.any():
        rest.update(state, tool, TICK_S, 0.0, cutting=False)
        ticks += 1
    assert ticks * TICK_S == pytest.approx(RESTING_TIME_S)
    assert state.asleep.all()


@pytest.mark.parametrize("why", ["moving", "cutting", "touching"])
def test_a_load_that_is_busy_stays_awake(make_state, tool_path, why):
    tool = tool_path(pitch=CARRY)
    speed = 1.1 * RESTING_SPEED_M_S if why == "moving" else 0.0
    state = loaded(make_state, tool, velocities=[[speed, 0.0, 0.0]] * 3)
    state.ground[1] = TOUCHES_GROUND if why == "touching" else 0
    rest = Rest()
    for _ in range(50):
        rest.update(state, tool, TICK_S, 0.0, cutting=why == "cutting")
        assert not state.asleep.any()


@pytest.mark.parametrize(("hit", "cutting", "wakes"), [(0.9, False, False), (1.1, False, True), (0.0, True, True)])
def test_a_hard_hit_and_cutting_wake_the_load_and_a_soft_hit_does_not(make_state, tool_path, hit, cutting, wakes):
    tool = tool_path(pitch=CARRY)
    state, rest = asleep_in(make_state, tool)
    rest.update(state, tool, TICK_S, hit * WAKING_SPEED_M_S, cutting=cutting)
    assert state.asleep.all() != wakes


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_tilt_wakes_the_load_however_slowly_it_comes(make_state, tool_path, sign):
    state, rest = asleep_in(make_state, tool_path(pitch=CARRY))
    for share in (0.3, 0.6, 0.95):
        rest.update(state, tool_path(pitch=CARRY + sign * share * WAKING_TILT_RAD), TICK_S, 0.0, cutting=False)
        assert state.asleep.all()
    rest.update(state, tool_path(pitch=CARRY + sign * 1.05 * WAKING_TILT_RAD), TICK_S, 0.0, cutting=False)
    assert not state.asleep.any()


@pytest.mark.parametrize("duration", [0.02, 0.05, RESTING_TIME_S])
def test_a_woken_load_gets_a_step_to_move_in(make_state, tool_path, duration):
    state, rest = asleep_in(make_state, tool_path(pitch=CARRY))
    rest.update(state, tool_path(pitch=CARRY + 1.05 * WAKING_TILT_RAD), duration, 0.0, cutting=False)
    assert not state.asleep.any()


def test_steady_motion_does_not_wake_the_load_and_a_lasting_acceleration_does(make_state, tool_path):
    """What counts is the direction of gravity minus acceleration."""
    still = tool_path(pitch=CARRY)
    state, rest = asleep_in(make_state, still)
    velocity, pull = np.zeros(3), GRAVITY_M_S2 * math.tan(1.2 * WAKING_TILT_RAD)
    woken_after = None
    for tick in range(1, 60):
        velocity = velocity + np.array([pull * TICK_S, 0.0, 0.0])
        rest.update(state, still._replace(linear=velocity), TICK_S, 0.0, cutting=False)
        if not state.asleep.any():
            woken_after = tick
            break
    assert woken_after is not None
    assert woken_after > 3  # a short jerk is no acceleration
    state, rest = asleep_in(make_state, still._replace(linear=velocity))
    for _ in range(50):
        rest.update(state, still._replace(linear=velocity), TICK_S, 0.0, cutting=False)
    assert state.asleep.all()


def test_a_parcel_that_joins_a_sleeping_load_falls_asleep_with_it(make_state, tool_path):
    tool = tool_path(pitch=CARRY)
    state, rest = asleep_in(make_state, tool)
    state.asleep[2] = 0
    for _ in range(30):
        rest.update(state, tool, TICK_S, 0.0, cutting=False)
    assert state.asleep.all()
