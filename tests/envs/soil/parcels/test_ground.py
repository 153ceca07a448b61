import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.ground import LEAST_GAP, LIFT, ground_below, press_ground
from lerobot_excav.envs.soil.parcels.plates import BoxWalls
from lerobot_excav.envs.soil.parcels.store import SHELTERED, TOUCHES_BOX_FLOOR, TOUCHES_GROUND, TOUCHES_OUTSIDE, State
from validation.soil.reference import ground as reference

RADIUS = 0.045
DT = 0.001
BOX = BoxWalls(4.2, 0.5, 0.2, 1.0, 0.6, 1.0, math.cos(0.4), math.sin(0.4))


def rough(site, rng):
    return site(0.3, rng.uniform(0.0, 0.5, (30, 30)), BOX, rng.uniform(0.0, 0.4, (10, 6)))


@given(seed=st.integers(0, 2**16), x=st.floats(-3.5, 5.5), y=st.floats(-3.5, 3.5))
@settings(max_examples=200)
def test_the_ground_below_is_that_of_the_reference(site, seed, x, y):
    ground = rough(site, np.random.default_rng(seed))
    place, height, normal = ground_below(ground, x, y)
    expected = reference.ground_below(ground, np.array([x, y]))
    assert place == expected[0]
    assert height == pytest.approx(expected[1], abs=1e-12)
    np.testing.assert_allclose(normal, expected[2], atol=1e-12)


def test_the_slope_in_a_turned_box_is_seen_in_the_world(site):
    """The soil rises along the box's own x axis, which points at 0.4 rad in the world."""
    rising = np.repeat(np.linspace(0.0, 0.5, 8)[:, None], 6, axis=1)
    _, _, normal = ground_below(site(box=BOX, box_heights=rising), BOX[0], BOX[1])
    assert math.atan2(-normal[1], -normal[0]) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("x", "y", "place"),
    [
        (0.0, 0.0, TOUCHES_GROUND),
        (2.99, 0.0, TOUCHES_GROUND),
        (-3.01, 0.0, TOUCHES_OUTSIDE),
        (BOX[0], BOX[1], TOUCHES_BOX_FLOOR),
    ],
)
def test_what_lies_below(site, x, y, place):
    assert ground_below(site(box=BOX), x, y)[0] == place


@given(seed=st.integers(0, 2**16))
@settings(max_examples=60)
def test_the_ground_presses_parcels_as_the_reference_does(random_state, site, laws, seed):
    rng = np.random.default_rng(seed)
    ground = rough(site, rng)
    state = random_state(rng, 30, [4.5, 3.0, 0.2], centre=(1.0, 0.0, 0.35))
    state.asleep[:] = rng.random(30) < 0.1
    state.shell[:] = SHELTERED * (rng.random(30) < 0.1)
    twin = State(*(array.copy() for array in state))
    highest = max(ground.heights.max(), ground.box_heights.max() + BOX[2])
    for _ in range(5):
        for s in (state, twin):
            s.forces[:] = 0.0
            s.torques[:] = 0.0
            s.positions[:] += 0.004 * s.velocities
        press_ground(state, ground, highest, laws.ground, DT)
        reference.press_ground(twin, ground, laws.ground, DT)
        for name in ("positions", "forces", "torques", "ground_springs"):
            np.testing.assert_allclose(getattr(state, name), getattr(twin, name), rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(state.ground, twin.ground)
        np.testing.assert_array_equal(state.on_ground, twin.on_ground)


def test_rising_ground_lifts_a_parcel_without_speed(make_state, site, laws):
    """By a little in each sub-step, up to where the contact itself carries on."""
    state = make_state([[0.0, 0.0, -0.1]])
    heights = []
    for _ in range(200):
        press_ground(state, site(), 0.0, laws.ground, DT)
        heights.append(float(state.positions[0, 2]))
    assert np.diff(heights).max() <= LIFT * RADIUS + 1e-12
    assert heights[-1] == pytest.approx(LEAST_GAP * RADIUS)
    assert not state.velocities.any()
