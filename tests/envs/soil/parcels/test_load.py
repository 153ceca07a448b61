import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.parcels.dynamics import WAKING_SPEED_M_S
from lerobot_excav.envs.soil.parcels.load import (
    RESTING_SPEED_M_S,
    RESTING_TIME_S,
    WAKING_TILT_RAD,
    Rest,
    find_load,
    put_to_sleep,
)
from lerobot_excav.envs.soil.parcels.store import TOUCHES_GROUND
from validation.soil.reference.load import is_load
from validation.soil.reference.worlds import MASS, make_state, random_state, tool_path

CARRY = math.pi
CARRIED = tool_path(pitch=CARRY)
IN_BUCKET = (0.6, 0.0, 0.25)


@given(seed=st.integers(0, 2**16), pitch=st.floats(-3.2, 3.2) | st.just(CARRY), moves=st.booleans())
@settings(max_examples=100)
def test_the_load_is_that_of_the_reference(seed, pitch, moves):
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


def loaded(**arrays):
    """Return three parcels in the carried bucket."""
    places = np.array([IN_BUCKET, (0.5, 0.1, 0.3), (0.7, -0.1, 0.2)])
    return make_state(CARRIED.positions[-1] + places @ CARRIED.rotations[-1].T, **arrays)


def updated(rest, state, tool, ticks=1, *, dt_s=TICK_S, hit=0.0, cutting=False):
    """Show a load to its `Rest` for some ticks; return who sleeps."""
    for _ in range(ticks):
        rest.update(state, tool, dt_s, hit, cutting=cutting)
    return state.asleep


@pytest.fixture
def asleep():
    """Return a load that has just fallen asleep."""
    state, rest = loaded(), Rest()
    assert updated(rest, state, CARRIED, math.ceil(RESTING_TIME_S / TICK_S)).all()
    return state, rest


def test_sleeping_parcels_stay_load_and_do_not_count_as_awake_load():
    state = make_state([CARRIED.rotations[0] @ IN_BUCKET] * 2, load=[1, 0], asleep=[1, 0])
    assert find_load(state, CARRIED)[0] == pytest.approx(MASS)
    np.testing.assert_array_equal(state.load, [1, 1])


def test_parcels_put_to_sleep_keep_their_place_in_the_bucket_and_forget_their_contacts():
    tool = tool_path((0.5, 0.2, 1.0), -2.8)
    state = make_state(tool.positions[0] + np.array([IN_BUCKET, (0.5, 0.1, 0.3), (0.0, 0.0, 2.0)]))
    state.load[:] = [1, 1, 0]
    state.plate_springs[:] = state.ground_springs[:] = 1.0
    put_to_sleep(state, tool)
    np.testing.assert_array_equal(state.asleep, [1, 1, 0])
    back = tool.positions[0] + state.places_t[:2] @ tool.rotations[0].T
    np.testing.assert_allclose(back, state.positions[:2], atol=1e-12)
    assert not state.plate_springs[:2].any()
    assert not state.ground_springs[:2].any()
    assert state.plate_springs[2].all()


def test_a_load_at_rest_falls_asleep_after_the_resting_time():
    state, rest = loaded(), Rest()
    ticks = round(RESTING_TIME_S / TICK_S)
    assert not updated(rest, state, CARRIED, ticks - 1).any()
    assert updated(rest, state, CARRIED).all()


@pytest.mark.parametrize("why", ["moving", "cutting", "touching"])
def test_a_load_that_is_busy_stays_awake(why):
    speed = 1.1 * RESTING_SPEED_M_S if why == "moving" else 0.0
    state = loaded(velocities=[[speed, 0.0, 0.0]] * 3)
    state.ground[1] = TOUCHES_GROUND if why == "touching" else 0
    assert not updated(Rest(), state, CARRIED, 50, cutting=why == "cutting").any()


@pytest.mark.parametrize(("hit", "cutting", "wakes"), [(0.9, False, False), (1.1, False, True), (0.0, True, True)])
def test_a_hard_hit_and_cutting_wake_the_load_and_a_soft_hit_does_not(asleep, hit, cutting, wakes):
    state, rest = asleep
    assert updated(rest, state, CARRIED, hit=hit * WAKING_SPEED_M_S, cutting=cutting).all() != wakes


@pytest.mark.parametrize("duration", [TICK_S, 0.05, RESTING_TIME_S])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_tilt_wakes_the_load_however_slowly_it_comes(asleep, sign, duration):
    """A woken load gets a step to move in, however long."""
    state, rest = asleep
    for share in (0.3, 0.6, 0.95):
        assert updated(rest, state, tool_path(pitch=CARRY + sign * share * WAKING_TILT_RAD)).all()
    tilted = tool_path(pitch=CARRY + sign * 1.05 * WAKING_TILT_RAD)
    assert not updated(rest, state, tilted, dt_s=duration).any()


def test_steady_motion_does_not_wake_the_load_and_a_lasting_acceleration_does(asleep):
    """What counts is the direction of gravity minus acceleration."""
    state, rest = asleep
    pull = GRAVITY_M_S2 * math.tan(1.2 * WAKING_TILT_RAD)
    for tick in range(1, 60):
        moving = CARRIED._replace(linear=np.array([tick * pull * TICK_S, 0.0, 0.0]))
        state.velocities[:] = moving.linear
        if not updated(rest, state, moving).any():
            break
    assert 3 < tick < 59  # a short jerk is no acceleration
    assert updated(rest, state, moving, 30).all()
    assert updated(rest, state, moving, 50).all()


def test_a_parcel_that_joins_a_sleeping_load_falls_asleep_with_it(asleep):
    state, rest = asleep
    state.asleep[2] = 0
    assert updated(rest, state, CARRIED, 30).all()
