import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET
from lerobot_excav.envs.soil.parcels.plates import (
    CLOSEST,
    BoxWalls,
    inside_depth,
    nearest_on_plate,
    press_box,
    press_bucket,
)
from lerobot_excav.envs.soil.parcels.store import OFF_BUCKET, OUTSIDE_OF_SHELL, SHELTERED, State
from validation.soil.reference import plates as reference

RADIUS = 0.045
DT = 0.001
MARGIN = 0.05
HALF = 0.5 * BUCKET.inner_width_m
SHELL = len(BUCKET.profile_t) - 1
BOX = BoxWalls(4.0, 1.0, 0.2, 0.6, 0.4, 1.0, math.cos(0.3), math.sin(0.3))

points = st.tuples(st.floats(-0.3, 1.5), st.floats(-0.7, 0.7), st.floats(-0.4, 0.9))


def copy(state):
    return State(*(array.copy() for array in state))


def assert_same(state, twin):
    for name in ("positions", "velocities", "forces", "torques", "plate_springs", "ground_springs"):
        np.testing.assert_allclose(getattr(state, name), getattr(twin, name), rtol=1e-9, atol=1e-9, err_msg=name)
    np.testing.assert_array_equal(state.shell, twin.shell)
    np.testing.assert_array_equal(state.ground, twin.ground)


def grains_of_plates():
    """Sample each plate of the bucket at points about 1 cm apart."""
    outline = BUCKET.profile_t
    plates = []
    for start, end in pairwise(outline):
        line = start + np.linspace(0.0, 1.0, 60)[:, None] * (end - start)
        plates.append(np.concatenate([np.insert(line, 1, y, axis=1) for y in np.linspace(-HALF, HALF, 73)]))
    x, z = np.meshgrid(np.arange(0.0, 1.2, 0.01), np.arange(0.0, 0.6, 0.01))
    lattice = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    side = lattice[(lattice @ BUCKET.planes_t[:-2, :3].T <= BUCKET.planes_t[:-2, 3] + 1e-9).all(axis=1)]
    border = [a + s * (b - a) for a, b in pairwise([*outline, outline[0]]) for s in np.linspace(0, 1, 60)]
    side = np.concatenate([side, np.insert(np.array(border), 1, 0.0, axis=1)])
    half = np.array([0.0, HALF, 0.0])
    return [*plates, side - half, side + half]


GRAINS = grains_of_plates()


@given(point=points, plate=st.integers(0, SHELL + 1))
@settings(max_examples=150)
def test_the_nearest_point_of_a_plate_is_that_of_the_reference_and_of_dense_samples(tool_path, point, plate):
    tool = tool_path()
    found = np.array(nearest_on_plate(tool.profile, tool.planes, tool.half_width, plate, point))
    expected = reference.nearest_point(reference.bucket_polygons(tool)[plate], np.array(point))
    np.testing.assert_allclose(found, expected, atol=1e-9)
    sampled = np.linalg.norm(GRAINS[plate] - point, axis=1).min()
    assert np.linalg.norm(found - point) == pytest.approx(sampled, abs=0.01)
    assert np.linalg.norm(found - point) <= sampled + 1e-9


@given(point=points)
@settings(max_examples=60)
def test_depth_inside_is_the_distance_to_the_nearest_plane(point):
    rest = BUCKET.planes_t[:, 3] - BUCKET.planes_t[:, :3] @ point
    assert inside_depth(BUCKET.planes_t, 0, point) == pytest.approx(rest.min())
    assert inside_depth(BUCKET.planes_t, 1, point) == pytest.approx(rest[1:].min())


@given(seed=st.integers(0, 2**16))
@settings(max_examples=25)
def test_the_bucket_presses_parcels_as_its_polygons_do(random_state, tool_path, laws, seed):
    rng = np.random.default_rng(seed)
    tool = tool_path(rng.uniform(-1.0, 1.0, 3), rng.uniform(-3.2, 0.5), rng.uniform(-0.05, 0.05, 3), 0.05, steps=4)
    near = tool.positions[0] + np.array([0.7, 0.0, 0.3]) @ tool.rotations[0].T
    state = random_state(rng, 20, [0.7, 0.6, 0.6], centre=near)
    state.asleep[:] = rng.random(20) < 0.2
    twin = copy(state)
    for step in range(4):  # four steps, so that springs stretch and contacts open
        for s in (state, twin):
            s.forces[:] = 0.0
            s.torques[:] = 0.0
            s.positions[:] += 0.004 * s.velocities
        press_bucket(state, step, tool, MARGIN, laws.steel, DT)
        reference.press_bucket(twin, step, tool, MARGIN, laws.steel, DT)
        assert_same(state, twin)


@given(seed=st.integers(0, 2**16))
@settings(max_examples=25)
def test_the_walls_of_the_box_press_parcels_as_their_polygons_do(random_state, laws, seed):
    rng = np.random.default_rng(seed)
    state = random_state(rng, 25, [0.9, 0.7, 0.7], centre=(4.0, 1.0, 0.7))
    state.asleep[:] = rng.random(25) < 0.2
    twin = copy(state)
    for _ in range(4):
        for s in (state, twin):
            s.forces[:] = 0.0
            s.torques[:] = 0.0
            s.positions[:] += 0.004 * s.velocities
        press_box(state, SHELL + 2, BOX, laws.steel, DT)
        reference.press_box(twin, SHELL + 2, BOX, laws.steel, DT)
        assert_same(state, twin)


def pressed(state, tool, laws):
    press_bucket(state, 0, tool, MARGIN, laws.steel, DT)
    return state


@pytest.mark.parametrize(
    ("point_t", "place"),
    [
        ((0.6, 0.0, 0.25), SHELTERED),
        ((0.6, 0.0, 0.02), OFF_BUCKET),  # inside, but near the opening
        ((0.6, 0.0, -0.3), OFF_BUCKET),
        ((0.43, 0.0, 0.60), OUTSIDE_OF_SHELL),
        ((0.6, HALF + 0.03, 0.2), OUTSIDE_OF_SHELL),
        ((0.6, HALF - 0.03, 0.2), SHELTERED),
        ((0.6, 0.0, 2.0), OFF_BUCKET),
    ],
)
def test_where_a_parcel_is_at_the_bucket(make_state, tool_path, laws, point_t, place):
    tool = tool_path((0.3, -0.2, 1.0), -2.5)
    state = make_state([tool.positions[0] + tool.rotations[0] @ point_t])
    assert pressed(state, tool, laws).shell[0] == place


@given(point=points)
@settings(max_examples=60)
def test_a_plate_puts_a_parcel_that_came_too_near_back_on_its_own_side(make_state, tool_path, laws, point):
    tool = tool_path()
    plates = reference.bucket_polygons(tool)
    state = make_state([tool.rotations[0] @ point])
    before = [np.array(point) - reference.nearest_point(plate, np.array(point)) for plate in plates]
    gaps = np.array([np.linalg.norm(away) for away in before])
    if (gaps < RADIUS).sum() != 1 or gaps.min() < 1e-6:
        return  # in a corner, plates push one after the other; exactly on a plate, there is no side
    point_t = pressed(state, tool, laws).positions[0] @ tool.rotations[0]
    for plate, away in zip(plates, before, strict=True):
        after = point_t - reference.nearest_point(plate, point_t)
        assert after @ away > 0.0
        assert np.linalg.norm(after) >= min(CLOSEST * RADIUS, float(np.linalg.norm(away))) - 1e-9


def test_a_contact_is_forgotten_when_its_parcel_leaves_the_reach_of_the_bucket_or_the_box(make_state, tool_path, laws):
    """Also of the corner that is farthest from the bucket's origin, and of the outside of a wall."""
    tool = tool_path(pitch=0.0)
    corner = np.array([1.15, HALF, 0.0])
    wall = np.array([4.0, 1.0, 0.7]) + 0.6 * np.array([BOX.cos, BOX.sin, 0.0])
    state = make_state([corner, wall], velocities=[(0.0, 0.0, 1.0)] * 2)
    outwards = np.array([corner / np.linalg.norm(corner), (BOX.cos, BOX.sin, 0.0)])
    for gap in (0.99, 1.2):  # in one sub-step, a parcel moves by less than a radius
        state.positions[:] = [corner, wall] + gap * RADIUS * outwards
        press_bucket(state, 0, tool, MARGIN, laws.steel, DT)
        press_box(state, SHELL + 2, BOX, laws.steel, DT)
        if gap < 1.0:
            assert state.plate_springs[0].any()
            assert state.plate_springs[1].any()
    assert not state.plate_springs.any()
