import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.ground import ground_below
from lerobot_excav.envs.soil.parcels.settling import (
    DROPPING_TIME_S,
    SETTLING_SPEED_M_S,
    SETTLING_TIME_S,
    find_settled,
)
from lerobot_excav.envs.soil.parcels.store import (
    OUTSIDE_OF_SHELL,
    TOUCHES_GROUND,
    TOUCHES_NOTHING,
    TOUCHES_OUTSIDE,
    empty_state,
)
from validation.soil.reference.worlds import site

DT_S = 0.02


def settled(state, site, bucket, reach, pace):
    """The same in whole arrays."""
    loose = (state.load == 0) & (state.asleep == 0)
    near = ((state.positions - bucket) ** 2).sum(axis=1) < reach**2
    limits = np.where(near, min(SETTLING_SPEED_M_S, pace), SETTLING_SPEED_M_S)
    slow = (state.velocities**2).sum(axis=1) < limits**2
    state.calm_s[:] = np.where(loose & slow, state.calm_s + DT_S, 0.0)
    for i in np.flatnonzero((state.calm_s >= DROPPING_TIME_S) & (state.ground == TOUCHES_NOTHING)):
        state.ground[i] = ground_below(site, state.positions[i, 0], state.positions[i, 1])[0]
    caught = (state.shell == OUTSIDE_OF_SHELL) & (state.ground == TOUCHES_GROUND)
    at_rest = state.calm_s >= SETTLING_TIME_S
    grounded = loose & (state.ground != TOUCHES_NOTHING)
    return grounded & (caught | at_rest | (state.ground == TOUCHES_OUTSIDE))


@given(seed=st.integers(0, 2**16), reach=st.sampled_from([0.0, 0.5, 2.0]), pace=st.floats(0.0, 1.0))
@settings(max_examples=40)
def test_what_settles_is_what_whole_arrays_say(seed, reach, pace):
    rng, count = np.random.default_rng(seed), 300
    state = empty_state(count, 4)
    state.positions[:], state.velocities[:] = rng.normal(0.0, 1.0, (2, count, 3)) * [[[1.0]], [[0.25]]]
    state.calm_s[:] = rng.choice([0.0, SETTLING_TIME_S, DROPPING_TIME_S], count)
    for flags, values in ((state.asleep, 2), (state.load, 2), (state.ground, 4), (state.shell, 3)):
        flags[:] = rng.integers(0, values, count)
    twin = state._replace(calm_s=state.calm_s.copy(), ground=state.ground.copy())
    around = np.zeros(3), reach, pace
    gone = find_settled(state, site(), *around, DT_S)
    np.testing.assert_array_equal(gone, settled(twin, site(), *around))
    np.testing.assert_array_equal(state.calm_s, twin.calm_s)
    np.testing.assert_array_equal(state.ground, twin.ground)
    assert 0 < gone.sum() < count
