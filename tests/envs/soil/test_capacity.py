import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil import reference
from lerobot_excav.envs.soil.benchmark import BUCKET, rotation_at
from lerobot_excav.envs.soil.capacity import Capacity
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.tool import ToolGeometry

SLOPE = PRESETS["sand"].slope_tan
LEVEL = math.pi


@pytest.mark.parametrize(("length", "width"), [(0.5, 0.72), (0.72, 0.72)])
@pytest.mark.parametrize("slope", [SLOPE, 1.0])
def test_the_heap_over_a_level_opening_is_the_sae_formula(length: float, width: float, slope: float) -> None:
    box = np.array([(length, 0.0), (length, 0.5), (0.0, 0.5), (0.0, 0.0)])
    geometry = ToolGeometry(profile_t=box, inner_width_m=width)
    heap = slope * (length**2 * width / 4 - length**3 / 12)
    held = Capacity(geometry, slope).retained_volume(LEVEL)
    assert held - geometry.struck_volume_m3 == pytest.approx(heap, rel=0.02)


def test_a_full_bucket_of_sand_weighs_what_operators_load() -> None:
    mass = Capacity(BUCKET, SLOPE).retained_volume(LEVEL) * 1474.0
    assert 470.0 <= mass <= 495.0


@given(pitch=st.floats(-4.5, 0.5), support=st.sampled_from([0.0, 0.3, 0.7]))
@settings(max_examples=15, deadline=None)
def test_retention_is_the_volume_of_the_retained_points(pitch: float, support: float) -> None:
    capacity = Capacity(BUCKET, SLOPE)
    expected = max(reference.retained_volume(BUCKET, SLOPE, pitch, s) for s in (0.0, support))
    assert capacity.retained_volume(pitch, support) == pytest.approx(expected, rel=0.01, abs=0.001)


def test_nothing_stays_in_a_bucket_that_faces_down() -> None:
    capacity = Capacity(BUCKET, SLOPE)
    for pitch in (-math.pi / 2, -math.pi / 4, 0.0):
        assert capacity.retained_volume(pitch) < 1e-3


def test_soil_in_front_of_the_opening_holds_the_load() -> None:
    held = [Capacity(BUCKET, SLOPE).retained_volume(-math.pi / 2, s) for s in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert held == sorted(held)
    assert held[-1] == pytest.approx(BUCKET.struck_volume_m3, rel=0.01)


@given(pitch=st.floats(-3.6, -1.9), share=st.floats(0.05, 0.95))
@settings(max_examples=40, deadline=None)
def test_the_load_lies_inside_the_bucket_or_its_heap(pitch: float, share: float) -> None:
    capacity = Capacity(BUCKET, SLOPE)
    load = capacity.load(share * capacity.retained_volume(pitch), pitch)
    beyond = BUCKET.planes_t[:, :3] @ load.com_t - BUCKET.planes_t[:, 3]
    assert beyond[1:].max() < 0.0  # behind every plate
    assert load.com_t[1] == 0.0
    assert len(load.surface_t) > 1


def test_more_load_lies_higher() -> None:
    capacity = Capacity(BUCKET, SLOPE)
    up_t = rotation_at(-2.8)[2]
    full = capacity.retained_volume(-2.8)
    heights = [float(up_t @ capacity.load(share * full, -2.8).com_t) for share in (0.1, 0.4, 0.7, 1.0)]
    assert heights == sorted(heights)


def test_the_level_found_holds_the_volume_asked_for() -> None:
    capacity = Capacity(BUCKET, SLOPE)
    load = capacity.load(0.1, LEVEL)
    up_t = rotation_at(LEVEL)[2]
    surface = load.surface_t @ up_t[[0, 2]]
    assert np.ptp(surface) < 1e-6  # a part load lies level
    below = ToolGeometry(profile_t=BUCKET.profile_t, inner_width_m=BUCKET.inner_width_m)
    depth = -surface[0]
    lattice = np.stack(
        np.meshgrid(np.arange(0.15, 1.16, 0.002), np.arange(depth, 0.6, 0.002)), axis=-1
    ).reshape(-1, 2)
    points = np.column_stack([lattice[:, 0], np.zeros(len(lattice)), lattice[:, 1]])
    area = reference.inside(below.planes_t, points).sum() * 0.002**2
    assert area * BUCKET.inner_width_m == pytest.approx(0.1, rel=0.02)


def test_an_empty_bucket_answers_with_its_centroid_and_no_surface() -> None:
    load = Capacity(BUCKET, SLOPE).load(0.0, LEVEL)
    np.testing.assert_array_equal(load.com_t, BUCKET.centroid_t)
    assert load.surface_t.shape == (0, 2)


def test_the_centre_of_mass_moves_without_a_jump_while_a_load_runs_out() -> None:
    capacity = Capacity(BUCKET, SLOPE)
    centres = np.array([capacity.load(0.2, pitch).com_t for pitch in np.linspace(-3.1, -0.5, 400)])
    assert np.linalg.norm(np.diff(centres, axis=0), axis=1).max() < 0.03


def test_a_load_on_its_way_out_is_still_drawn() -> None:
    assert len(Capacity(BUCKET, SLOPE).load(0.2, -math.pi / 2).surface_t) > 1


@given(
    pitch=st.floats(-3.6, -0.1), share=st.floats(0.05, 1.5), support=st.sampled_from([0.0, 1e-9, 0.4, 1.0])
)
@settings(max_examples=40, deadline=None)
def test_no_two_points_of_the_drawn_surface_coincide(pitch: float, share: float, support: float) -> None:
    surface = Capacity(BUCKET, SLOPE).load(share * BUCKET.struck_volume_m3, pitch, support).surface_t
    assert np.isfinite(surface).all()
    assert np.linalg.norm(np.diff(surface, axis=0), axis=1).min(initial=1.0) > 1e-7
