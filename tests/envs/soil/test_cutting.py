import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.cutting import ALREADY_INSIDE, column_interval, column_line, crossed_face, cut
from lerobot_excav.envs.soil.motion import Pose
from lerobot_excav.envs.soil.parcels.birth import Intake
from validation.soil.reference import bucket as reference
from validation.soil.reference.worlds import flat

CELL = 0.05
PARCEL_RADIUS = 0.045
PLANES = BUCKET.planes_t


def rotation(yaw, pitch, roll):
    about_z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    return about_z @ rotation_at(pitch) @ about_x


def pose(edge, turned):
    return Pose(position=np.array(edge) - turned @ np.array([1.15, 0.0, 0.0]), rotation=turned)


def move(field, before, now, room=1.0, bins=4, intake=None):
    intake = intake or Intake(BUCKET, PARCEL_RADIUS)
    low, high = now.place(BUCKET.corners_t).min(axis=0), now.place(BUCKET.corners_t).max(axis=0)
    window = field.window(np.stack([low - 0.5 * CELL, high + 0.5 * CELL]))
    columns = field.heights, field.layer.firm, 1.0, field.active, field.grid
    return cut(*columns, PLANES, before, now, window, bins, room, 1e-9, intake.bins)


angles = st.tuples(st.floats(-3.1, 3.1), st.floats(-3.5, 0.5), st.floats(-0.2, 0.2))


@given(angles=angles, x=st.floats(-1.2, 1.2), y=st.floats(-1.2, 1.2))
@settings(max_examples=80)
def test_a_vertical_line_is_inside_exactly_where_its_points_are(angles, x, y):
    turned, z = rotation(*angles), np.arange(-2.0, 2.0, 0.001)
    low, high, top = column_interval(PLANES, np.zeros(3), turned, x, y)
    found = reference.column_interval(PLANES, np.zeros(3), turned, np.array([x, y]), z)
    if found is None:
        assert high - low <= 0.001
        return
    assert low == pytest.approx(found[0], abs=0.0011)
    assert high == pytest.approx(found[1], abs=0.0011)
    upper_end = turned.T @ np.array([x, y, high])
    assert PLANES[top, :3] @ upper_end == pytest.approx(PLANES[top, 3], abs=1e-9)


points = st.tuples(st.floats(-0.2, 1.5), st.floats(-0.6, 0.6), st.floats(-0.3, 0.8))


@given(before=points, mix=st.lists(st.floats(0.01, 1.0), min_size=16, max_size=16))
@settings(max_examples=100)
def test_a_point_came_through_the_face_that_the_reference_finds(before, mix):
    now = np.array(mix) @ BUCKET.corners_t / sum(mix)
    expected = reference.crossed_face(PLANES, np.array(before), now)
    assert crossed_face(PLANES, before, tuple(now)) == expected
    assert (expected == ALREADY_INSIDE) == bool(reference.inside(PLANES, np.array([before]))[0])


@given(
    angles=angles,
    edge=st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(0.0, 0.6)),
    step=st.tuples(st.floats(-0.025, 0.025), st.floats(-0.025, 0.025), st.floats(-0.025, 0.025)),
    room=st.sampled_from([0.0, 0.001, 1.0]),
)
@settings(max_examples=60)
def test_every_cut_keeps_the_volume_and_leaves_the_bucket_clear(angles, edge, step, room):
    turned, field = rotation(*angles), flat(0.5, 60)
    before, now = pose(edge, turned), pose(np.add(edge, step), turned)
    volume, intake = field.volume_m3, Intake(BUCKET, PARCEL_RADIUS)
    entered, lost = move(field, before, now, room, intake=intake)
    assert intake.waiting_m3 == pytest.approx(entered, abs=1e-12)
    assert (intake.bins.volumes >= 0.0).all()
    assert field.volume_m3 + entered + lost == pytest.approx(volume, abs=1e-12)
    assert 0.0 <= entered <= room
    assert (field.heights >= 0.0).all()
    for i, j in np.ndindex(field.heights.shape):
        low, high, _ = column_interval(PLANES, now.position, turned, *column_line(field.grid, i, j))
        if low < high and high >= 0.5:  # no soil above the bucket that could have fallen in
            assert field.heights[i, j] <= max(low, 0.0) + 1e-9


def test_soil_before_the_opening_enters_and_more_bins_see_a_thinner_layer():
    """Two samples per column decide for half a column at a time, eight see the corner of the opening."""
    turned = rotation_at(math.radians(-135))
    coarse, fine = (
        move(flat(0.5, 60), pose((0.0, 0.0, 0.2), turned), pose((-0.02, 0.0, 0.16), turned), bins=bins)[0]
        for bins in (2, 8)
    )
    assert coarse != fine
    assert coarse == pytest.approx(fine, rel=0.2)
    assert fine > 0.0


@pytest.mark.parametrize(
    ("pitch_deg", "start", "step", "room", "axis", "least"),
    [
        (-90, (0.0, 0.0, 0.2), (0.05, 0.0, 0.0), 1.0, 0, -0.01),  # behind the back
        (-150, (-0.3, 0.0, 0.5), (0.0, 0.05, 0.0), 1.0, 1, 0.36),  # beside a side plate
        (-120, (0.0, 0.0, 0.2), (-0.05, 0.0, 0.0), 0.0, 0, None),  # a full bucket: before it
    ],
)
def test_what_cannot_enter_piles_up_on_the_side_to_which_the_bucket_moves(pitch_deg, start, step, room, axis, least):
    turned, field = rotation_at(math.radians(pitch_deg)), flat(0.5, 60)
    before, now = pose(start, turned), pose(np.add(start, step), turned)
    while move(field, before, before)[0] > 0.0:
        pass  # soil above the opening falls in
    heights = field.heights.copy()
    entered, _ = move(field, before, now, room)
    grown = np.array([column_line(field.grid, *ij)[axis] for ij in np.argwhere(field.heights > heights + 1e-12)])
    assert entered == pytest.approx(0.0, abs=1e-12)
    assert len(grown) > 0
    assert grown.max() < -0.05 if least is None else grown.min() > least


def test_soil_over_the_border_is_counted():
    turned, field = rotation_at(math.radians(-120)), flat(0.5, 60)
    volume, edge = field.volume_m3, -1.5 + 0.06
    _, lost = move(field, pose((edge, 0.0, 0.2), turned), pose((edge - 0.05, 0.0, 0.2), turned), room=0.0)
    assert lost > 0.0
    assert field.volume_m3 + lost == pytest.approx(volume, abs=1e-12)
