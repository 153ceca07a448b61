import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.ground import LEAST_GAP, LIFT, ground_below, press_ground
from lerobot_excav.envs.soil.parcels.plates import BoxWalls
from lerobot_excav.envs.soil.parcels.store import SHELTERED
from validation.soil.reference import ground as reference
from validation.soil.reference.worlds import DT, LAWS, RADIUS, make_state, press_both, random_state, site

BOX = BoxWalls(4.2, 0.5, 0.2, 1.0, 0.6, 1.0, math.cos(0.4), math.sin(0.4))


def rough(rng):
    return site(0.3, rng.uniform(0.0, 0.5, (30, 30)), BOX, rng.uniform(0.0, 0.4, (10, 6)))


@given(seed=st.integers(0, 2**16), x=st.floats(-3.5, 5.5), y=st.floats(-3.5, 3.5))
@settings(max_examples=200)
def test_the_ground_below_is_that_of_the_reference(seed, x, y):
    ground = rough(np.random.default_rng(seed))
    place, height, normal = ground_below(ground, x, y)
    expected = reference.ground_below(ground, np.array([x, y]))
    assert place == expected[0]
    assert height == pytest.approx(expected[1], abs=1e-12)
    np.testing.assert_allclose(normal, expected[2], atol=1e-12)


@given(seed=st.integers(0, 2**16))
@settings(max_examples=60)
def test_the_ground_presses_parcels_as_the_reference_does(seed):
    rng = np.random.default_rng(seed)
    ground = rough(rng)
    state = random_state(rng, 30, [4.5, 3.0, 0.2], centre=(1.0, 0.0, 0.35))
    state.asleep[:] = rng.random(30) < 0.1
    state.shell[:] = SHELTERED * (rng.random(30) < 0.1)
    highest = max(ground.heights.max(), ground.box_heights.max() + BOX[2])
    press_both(
        state,
        lambda parcels, _: press_ground(parcels, ground, highest, LAWS.ground, DT),
        lambda parcels, _: reference.press_ground(parcels, ground, LAWS.ground, DT),
        *("ground_springs", "ground", "on_ground"),
    )


def test_rising_ground_lifts_a_parcel_without_speed():
    """By a little in each sub-step, up to where the contact itself carries on."""
    state = make_state([[0.0, 0.0, -0.1]])
    heights = []
    for _ in range(200):
        press_ground(state, site(), 0.0, LAWS.ground, DT)
        heights.append(float(state.positions[0, 2]))
    assert np.diff(heights).max() <= LIFT * RADIUS + 1e-12
    assert heights[-1] == pytest.approx(LEAST_GAP * RADIUS)
    assert not state.velocities.any()
