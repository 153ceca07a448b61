import math
import pickle
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.height_field import Grid
from lerobot_excav.envs.soil.parcels import population as module
from lerobot_excav.envs.soil.parcels.ground import Site
from lerobot_excav.envs.soil.parcels.plates import NO_BOX
from lerobot_excav.envs.soil.parcels.settling import SETTLING_SPEED_M_S, SETTLING_TIME_S
from lerobot_excav.envs.soil.parcels.store import (
    OUTSIDE_OF_SHELL,
    TOUCHES_BOX_FLOOR,
    TOUCHES_GROUND,
    TOUCHES_NOTHING,
    TOUCHES_OUTSIDE,
)
from validation.soil.reference import motion as reference
from validation.soil.reference.worlds import LAWS, MASS, RADIUS, make_population, no_tool, site, tool_path

STEPS = 20

NO_GROUND = Site(np.zeros((2, 2)), Grid(0.0, 0.0, 1e-6, 1e-6), np.zeros((1, 1)), Grid(0.0, 0.0, 1.0, 1.0), NO_BOX, 0.0)


def add(population, positions, velocities=None, masses=None):
    points = np.asarray(positions, dtype=np.float64)
    moving = np.zeros_like(points) if velocities is None else np.asarray(velocities, dtype=np.float64)
    population.add(points, moving, np.full(len(points), MASS) if masses is None else np.asarray(masses), apart=False)


@given(seed=st.integers(0, 2**16))
@settings(max_examples=30)
def test_beyond_the_bound_parcels_join_others_with_mass_momentum_and_centre_of_mass(seed):
    rng = np.random.default_rng(seed)
    positions, velocities = rng.uniform(-1.0, 1.0, (30, 3)), rng.normal(0.0, 1.0, (30, 3))
    masses = rng.uniform(0.1, 1.0, 30)  # 12 parcels can take all of them
    population = make_population(most_awake=12)
    add(population, positions[:5], velocities[:5], masses[:5])
    add(population, positions[5:], velocities[5:], masses[5:])
    state = population.state
    assert population.awake_count == len(state.masses) == 12
    assert state.masses.sum() == pytest.approx(masses.sum(), rel=1e-14)
    np.testing.assert_allclose(state.masses @ state.velocities, masses @ velocities, atol=1e-12)
    np.testing.assert_allclose(state.masses @ state.positions, masses @ positions, atol=1e-12)
    np.testing.assert_allclose(state.radii, RADIUS * np.cbrt(state.masses / MASS))


def test_a_parcel_too_many_joins_the_nearest_one_that_is_awake():
    population = make_population(most_awake=3)
    add(population, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    population.state.asleep[2] = 1
    add(population, [[9.0, 0.0, 0.0], [1.9, 0.0, 0.0]])
    np.testing.assert_allclose(population.state.masses, [MASS, 2 * MASS, MASS, MASS])
    assert population.state.positions[1, 0] == pytest.approx(1.45)


def fallen(population, tool, site, ticks, rng):
    """Rain parcels and step."""
    landed = []
    for tick in range(ticks):
        if tick % 2 == 0:
            add(population, np.array([0.0, 0.0, 0.4]) + rng.uniform(-0.15, 0.15, (4, 3)))
        population.step(tool, site, TICK_S, cutting=False)
        landed.append(population.settle(NO_GROUND, TICK_S))
    return landed


def bits(population, landed):
    parts = [array for one in landed for array in (one.points_w, one.masses_kg)]
    return [array.tobytes() for array in (*population.state, *parts)]


def test_growing_beyond_the_first_room_and_clearing_change_nothing(monkeypatch):
    runs = []
    for capacity in (3, 17, 1024):
        monkeypatch.setattr(module, "_FIRST_CAPACITY", capacity)
        population = make_population()
        for _ in range(2):
            landed = fallen(population, no_tool(STEPS), site(), 40, np.random.default_rng(0))
            runs.append(bits(population, landed))
            assert len(population.state.masses) > 17
            assert sum(len(part.masses_kg) for part in landed) > 10
            population.clear()
            assert len(population.state.masses) == population.awake_count == 0
    assert all(run == runs[0] for run in runs)


@pytest.mark.slow
def test_parcels_that_come_and_go_leave_the_memory_of_the_others_alone():
    """Heaps slide along a smooth gutter over the border: what touches the ground there leaves at once."""
    smooth = LAWS._replace(ground=LAWS.ground._replace(sliding=0.0, rolling=0.0))
    gutter = site(heights=np.repeat(np.abs(np.linspace(-2.95, 2.95, 60))[None, :], 60, axis=0))
    population, memory = make_population(laws=smooth), {}
    row, rng, speed = 1.98 * RADIUS * np.arange(8.0), np.random.default_rng(1), np.array([4.0, 0.0, 0.0])
    heap = np.concatenate([np.column_stack([row, 0.0 * row, z + 0.0 * row]) for z in (1.42 * RADIUS, 3.38 * RADIUS)])
    left = joined = remembered = 0
    for tick in range(16):
        if tick in (0, 4, 8):
            add(population, heap + np.array([2.2, 0.0, 0.0]), speed + rng.normal(0.0, 0.01, (16, 3)))
            joined += tick > 0
        twin = deepcopy(population.state)
        population.step(no_tool(STEPS), gutter, TICK_S, cutting=False)
        reference.advance(twin, memory, no_tool(STEPS), gutter, smooth, TICK_S / STEPS, STEPS, np.zeros(6))
        np.testing.assert_allclose(population.state.positions, twin.positions, atol=1e-9)
        np.testing.assert_allclose(population.state.velocities, twin.velocities, atol=1e-7)
        gone = (population.state.ground == TOUCHES_OUTSIDE) & (population.state.load == 0)
        left += len(population.settle(NO_GROUND, TICK_S).masses_kg)
        rows = np.cumsum(~gone) - 1
        pairs = {(i, j): springs for (i, j), springs in memory.items() if not gone[i] and not gone[j]}
        memory = {(int(rows[i]), int(rows[j])): springs for (i, j), springs in pairs.items()}
        remembered = max(remembered, sum(np.abs(springs[:3]).max() > 1e-6 for springs in memory.values()))
    assert left >= 8
    assert joined == 2
    assert remembered >= 8


WHILE = math.ceil(SETTLING_TIME_S / TICK_S - 1e-9)
SLOW, FAST = [0.9 * SETTLING_SPEED_M_S, 0.0, 0.0], [1.1 * SETTLING_SPEED_M_S, 0.0, 0.0]


@pytest.mark.parametrize(
    ("arrays", "ticks"),
    [
        ({"ground": TOUCHES_GROUND, "velocities": SLOW}, WHILE),
        ({"ground": TOUCHES_BOX_FLOOR, "velocities": SLOW}, WHILE),
        ({"ground": TOUCHES_GROUND, "velocities": FAST}, None),
        ({"ground": TOUCHES_NOTHING}, None),
        ({"ground": TOUCHES_GROUND, "load": 1}, None),
        ({"ground": TOUCHES_GROUND, "load": 1, "asleep": 1}, None),
        ({"ground": TOUCHES_OUTSIDE, "load": 1}, None),
        ({"ground": TOUCHES_OUTSIDE, "velocities": FAST}, 1),  # beyond the border
        ({"ground": TOUCHES_GROUND, "shell": OUTSIDE_OF_SHELL, "velocities": FAST}, 1),  # under the bucket
    ],
)
def test_a_parcel_becomes_ground_after_a_while_at_rest_or_at_once_or_never(arrays, ticks):
    population = make_population()
    add(population, [[0.1, 0.2, RADIUS]])
    for name, value in arrays.items():  # what a step would have found out about it
        getattr(population.state, name)[-1] = value
    landed = [len(population.settle(NO_GROUND, TICK_S).masses_kg) for _ in range(20)]
    assert landed == [int(tick == ticks) for tick in range(1, 21)]
    assert len(population.state.masses) == (ticks is None)


def test_the_rest_must_not_be_interrupted():
    population = make_population()
    add(population, [[0.1, 0.2, RADIUS]])
    population.state.ground[0] = TOUCHES_GROUND
    for tick in range(15):
        population.state.velocities[0, 0] = 2.0 * SETTLING_SPEED_M_S if tick % WHILE == WHILE - 1 else 0.0
        assert len(population.settle(NO_GROUND, TICK_S).masses_kg) == 0


def test_what_landed_says_where_and_how_much_and_the_others_stay():
    population = make_population()
    add(population, np.arange(15.0).reshape(5, 3), masses=MASS * np.arange(1.0, 6.0))
    population.state.ground[:] = [TOUCHES_OUTSIDE, TOUCHES_NOTHING, TOUCHES_BOX_FLOOR, TOUCHES_GROUND, TOUCHES_NOTHING]
    population.state.calm_s[:] = SETTLING_TIME_S
    landed = population.settle(NO_GROUND, TICK_S)
    np.testing.assert_array_equal(landed.points_w, [[0.0, 1.0], [6.0, 7.0], [9.0, 10.0]])
    np.testing.assert_allclose(landed.masses_kg, MASS * np.array([1.0, 3.0, 4.0]))
    np.testing.assert_array_equal(landed.is_on_ground, [False, False, True])
    np.testing.assert_array_equal(landed.is_in_box, [False, True, False])
    np.testing.assert_allclose(population.state.masses, MASS * np.array([2.0, 5.0]))


def test_a_parcel_under_a_bucket_that_comes_down_becomes_ground_and_holds_nothing_up():
    """The back of a carried bucket is let down on a parcel that lies on the ground."""
    population = make_population()
    depth = float(BUCKET.profile_t[:, 1].max())
    under = float(BUCKET.profile_t[np.argmax(BUCKET.profile_t[:, 1]), 0])
    add(population, [[-under, 0.0, RADIUS]])
    top, left = depth + 3.0 * RADIUS, 0
    for _ in range(20):
        tool = tool_path((0.0, 0.0, top), math.pi, (0.0, 0.0, -0.008), steps=STEPS)
        top -= 0.008
        population.step(tool, site(), TICK_S, cutting=False)
        left += len(population.settle(NO_GROUND, TICK_S).masses_kg)
    assert top < depth + RADIUS
    assert left == 1
    assert population.state.masses.sum() == 0.0


def test_another_number_of_plates_clears_their_memory_and_nothing_else():
    population = make_population()
    add(population, [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])
    population.state.plate_springs[:] = 1.0
    plates = population.state.plate_springs.shape[1]
    population.allow_plates(plates)
    assert population.state.plate_springs.all()
    population.allow_plates(plates + 2)
    assert population.state.plate_springs.shape == (2, plates + 2, 6)
    assert not population.state.plate_springs.any()
    np.testing.assert_array_equal(population.state.positions[:, 2], [1.0, 2.0])


@pytest.mark.parametrize("copied", [deepcopy, lambda population: pickle.loads(pickle.dumps(population))])
def test_a_copy_goes_on_like_its_original(copied):
    original = make_population()
    fallen(original, no_tool(STEPS), site(), 12, np.random.default_rng(0))
    other = copied(original)
    for population in (original, other):
        population.step(no_tool(STEPS), site(), TICK_S, cutting=False)
        landed = fallen(population, no_tool(STEPS), site(), 12, np.random.default_rng(1))
        assert any(len(one.masses_kg) for one in landed)
    assert len(original.state.masses) > 0
    for own, same in zip(original.state, other.state, strict=True):
        np.testing.assert_array_equal(own, same)
