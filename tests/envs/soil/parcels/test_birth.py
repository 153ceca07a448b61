import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.soil import BUCKET
from lerobot_excav.envs.soil.parcels.birth import Intake, gather
from validation.soil.reference.worlds import RADIUS

PARCEL_M3 = 6.4e-4
EDGE, LIP = BUCKET.profile_t[0], BUCKET.profile_t[-1]
HALF = 0.5 * BUCKET.inner_width_m


def bin_of(intake, point_t):
    """Return the bin: equal parts of the way from edge to lip and of the width; the outer ones reach on."""
    rows, columns = intake.bins.volumes.shape
    share = (point_t[[0, 2]] - EDGE) @ (LIP - EDGE) / ((LIP - EDGE) @ (LIP - EDGE))
    across = (point_t[1] + HALF) / (2.0 * HALF)
    return int(np.clip(share, 0.0, 0.999999) * rows), int(np.clip(across, 0.0, 0.999999) * columns)


def filled(entries):
    intake = Intake(BUCKET, RADIUS)
    for point, volume in entries:
        gather(intake.bins, *point, volume)
    return intake


points = st.tuples(st.floats(-0.2, 1.4), st.floats(-0.6, 0.6), st.floats(-0.2, 0.6))


@given(entries=st.lists(st.tuples(points, st.floats(0.0, 1e-3)), min_size=1, max_size=20))
@settings(max_examples=60)
def test_what_enters_waits_in_the_bin_before_which_it_lay(entries):
    intake = filled(entries)
    expected = np.zeros_like(intake.bins.volumes)
    for point, volume in entries:
        expected[bin_of(intake, np.array(point))] += volume
    np.testing.assert_allclose(intake.bins.volumes, expected, atol=1e-15)
    assert intake.waiting_m3 == pytest.approx(sum(volume for _, volume in entries), abs=1e-15)


def test_bins_are_about_as_wide_as_a_parcel():
    rows, columns = Intake(BUCKET, RADIUS).bins.volumes.shape
    assert np.linalg.norm(LIP - EDGE) / rows == pytest.approx(2 * RADIUS, rel=0.1)
    assert BUCKET.inner_width_m / columns == pytest.approx(2 * RADIUS, rel=0.1)
    assert Intake(BUCKET, 10.0).bins.volumes.shape == (1, 1)


@given(entries=st.lists(st.tuples(points, st.floats(0.0, 3e-3)), min_size=1, max_size=30), seed=st.integers(0, 99))
@settings(max_examples=60)
def test_whole_parcels_leave_and_less_than_one_waits(entries, seed):
    intake = filled(entries)
    total = intake.waiting_m3
    born = intake.births(PARCEL_M3, np.random.default_rng(seed))
    assert born.shape == (int(total / PARCEL_M3), 3)
    assert intake.waiting_m3 == pytest.approx(total - len(born) * PARCEL_M3, abs=1e-15)
    assert intake.waiting_m3 < PARCEL_M3 * (1.0 + 1e-9)


@given(point=points, seed=st.integers(0, 99))
@settings(max_examples=60)
def test_a_parcel_is_born_inside_the_bucket_near_to_where_its_soil_entered(point, seed):
    intake = filled([(point, 1.5 * PARCEL_M3)])
    row, column = bin_of(intake, np.array(point))
    born = intake.births(PARCEL_M3, np.random.default_rng(seed))[0]
    beyond = BUCKET.planes_t[:, :3] @ born - BUCKET.planes_t[:, 3]
    assert beyond.max() < -0.4 * RADIUS
    rows, columns = intake.bins.volumes.shape
    entrance = EDGE + (row + 0.5) / rows * (LIP - EDGE)
    across = ((column + 0.5) / columns - 0.5) * 2.0 * HALF
    place = np.array([entrance[0], across, entrance[1]])
    assert np.linalg.norm(born - place) < 4.0 * RADIUS  # the acute corner at the edge pushes farthest


def test_the_fullest_bin_gives_first():
    intake = Intake(BUCKET, RADIUS)
    intake.bins.volumes[:] = 0.1 * PARCEL_M3
    intake.bins.volumes[2, 3] = 0.9 * PARCEL_M3
    before = intake.waiting_m3
    intake.births(before, np.random.default_rng(0))
    assert np.argmin(intake.bins.volumes) == np.ravel_multi_index((2, 3), intake.bins.volumes.shape)
