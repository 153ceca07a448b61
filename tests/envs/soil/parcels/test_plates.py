import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET
from lerobot_excav.envs.soil.parcels import plates
from lerobot_excav.envs.soil.parcels.plates import CLOSEST, BoxWalls, nearest_on_plate
from validation.soil.reference import plates as reference
from validation.soil.reference.worlds import DT, LAWS, RADIUS, make_state, press_both, random_state, tool_path

MARGIN = 0.05
HALF = 0.5 * BUCKET.inner_width_m
SHELL = len(BUCKET.profile_t) - 1
BOX = BoxWalls(4.0, 1.0, 0.2, 0.6, 0.4, 1.0, math.cos(0.3), math.sin(0.3))

points = st.tuples(st.floats(-0.3, 1.5), st.floats(-0.7, 0.7), st.floats(-0.4, 0.9))


@given(point=points, plate=st.integers(0, SHELL + 1))
@settings(max_examples=150)
def test_the_nearest_point_of_a_plate_is_that_of_the_reference(point, plate):
    """All corners of a convex plate lie beyond the plane through its nearest point, seen from the point."""
    tool = tool_path()
    found = np.array(nearest_on_plate(tool.profile, tool.planes, tool.half_width, plate, point))
    polygon = reference.bucket_polygons(tool)[plate]
    np.testing.assert_allclose(found, reference.nearest_point(polygon, np.array(point)), atol=1e-9)
    assert ((polygon - found) @ (point - found) <= 1e-9).all()


@given(seed=st.integers(0, 2**16), at_box=st.booleans())
@settings(max_examples=20)
def test_bucket_and_box_press_parcels_as_their_polygons_do(seed, at_box):
    rng = np.random.default_rng(seed)
    tool = tool_path(rng.uniform(-1.0, 1.0, 3), rng.uniform(-3.2, 0.5), rng.uniform(-0.05, 0.05, 3), 0.05, steps=4)
    near = (4.0, 1.0, 0.7) if at_box else tool.positions[0] + np.array([0.7, 0.0, 0.3]) @ tool.rotations[0].T
    state = random_state(rng, 20, [0.8, 0.6, 0.6], centre=near)
    state.asleep[:] = rng.random(20) < 0.2

    pushes = {plates: np.zeros(6), reference: np.zeros(6)}

    def act(module):
        if at_box:
            return lambda parcels, _: module.press_box(parcels, SHELL + 2, BOX, LAWS.steel, DT)
        return lambda parcels, step: module.press_bucket(parcels, step, tool, MARGIN, LAWS.steel, DT, pushes[module])

    press_both(state, act(plates), act(reference), "plate_springs", "shell", times=4)
    np.testing.assert_allclose(pushes[plates], pushes[reference], atol=1e-9)


@given(point=points)
@settings(max_examples=60)
def test_a_plate_puts_a_parcel_that_came_too_near_back_on_its_own_side(point):
    tool = tool_path()
    polygons = reference.bucket_polygons(tool)
    state = make_state([tool.rotations[0] @ point])
    before = [np.array(point) - reference.nearest_point(plate, np.array(point)) for plate in polygons]
    gaps = np.array([np.linalg.norm(away) for away in before])
    if (gaps < RADIUS).sum() != 1 or gaps.min() < 1e-6:
        return  # in a corner, plates push one after the other; exactly on a plate, there is no side
    plates.press_bucket(state, 0, tool, MARGIN, LAWS.steel, DT, np.zeros(6))
    point_t = state.positions[0] @ tool.rotations[0]
    for plate, away in zip(polygons, before, strict=True):
        after = point_t - reference.nearest_point(plate, point_t)
        assert after @ away > 0.0
        assert np.linalg.norm(after) >= min(CLOSEST * RADIUS, float(np.linalg.norm(away))) - 1e-9


def test_a_contact_is_forgotten_when_its_parcel_leaves_the_reach_of_the_bucket_or_the_box():
    """Also of the corner that is farthest from the bucket's origin, and of the outside of a wall."""
    tool = tool_path(pitch=0.0)
    corner = np.array([1.15, HALF, 0.0])
    wall = np.array([4.0, 1.0, 0.7]) + 0.6 * np.array([BOX.cos, BOX.sin, 0.0])
    state = make_state([corner, wall], velocities=[(0.0, 0.0, 1.0)] * 2)
    outwards = np.array([corner / np.linalg.norm(corner), (BOX.cos, BOX.sin, 0.0)])
    for gap in (0.99, 1.2):  # in one sub-step, a parcel moves by less than a radius
        state.positions[:] = [corner, wall] + gap * RADIUS * outwards
        plates.press_bucket(state, 0, tool, MARGIN, LAWS.steel, DT, np.zeros(6))
        plates.press_box(state, SHELL + 2, BOX, LAWS.steel, DT)
        if gap < 1.0:
            assert state.plate_springs[0].any()
            assert state.plate_springs[1].any()
    assert not state.plate_springs.any()
