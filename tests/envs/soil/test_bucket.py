import dataclasses
import math

import numpy as np
import pytest

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.soil.bucket import Bucket, heaped_volume_m3
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.tool import ToolGeometry
from lerobot_excav.errors import ConfigurationError

SAND = PRESETS["sand"]
CELL = 0.05


def fresh(height=0.8):
    field = HeightField((60, 60), (CELL, CELL), 0.0)
    field.reset(np.full((60, 60), height))
    return Bucket(SAND, FIDELITIES["standard"]), field


def dig(bucket, field, load_m3=0.0, ticks=30):
    """Drag the bucket through the ground; return the volume that entered."""
    entered = 0.0
    for tick in range(ticks):
        tool = tool_at(np.array([0.5 - 0.02 * tick, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
        entered += bucket.move(tool, field, 0.0, load_m3)[0]
    return entered


@pytest.mark.parametrize(("length", "width"), [(0.5, 0.72), (0.72, 0.72), (0.9, 0.6)])
@pytest.mark.parametrize("slope", [SAND.slope_tan, 1.0])
def test_the_heap_over_a_level_opening_is_a_hip_roof(length, width, slope):
    """At slope 1 it is the heap of SAE J296."""
    box = np.array([(length, 0.0), (length, 0.5), (0.0, 0.5), (0.0, 0.0)])
    geometry = ToolGeometry(profile_t=box, inner_width_m=width)
    heap = heaped_volume_m3(geometry, slope) - geometry.struck_volume_m3
    x, y = np.meshgrid((np.arange(500) + 0.5) / 500 * length, (np.arange(500) + 0.5) / 500 * width, indexing="ij")
    roof = slope * np.minimum(np.minimum(x, length - x), np.minimum(y, width - y))
    assert heap == pytest.approx(roof.mean() * length * width, rel=1e-3)


def test_what_enters_waits_and_what_waits_is_born():
    bucket, field = fresh()
    volume = field.volume_m3
    entered = dig(bucket, field)
    assert entered > 0.01
    assert bucket.waiting_m3 == pytest.approx(entered)
    assert field.volume_m3 + entered == pytest.approx(volume)
    points, masses = bucket.births(all_of_it=False, rng=np.random.default_rng(0))
    whole = SAND.parcel_mass_kg(FIDELITIES["standard"].parcel_radius_m)
    assert len(points) == len(masses) == int(entered * SAND.density_kg_m3 / whole)
    np.testing.assert_allclose(masses, whole)
    assert masses.sum() + bucket.waiting_m3 * SAND.density_kg_m3 == pytest.approx(
        entered * SAND.density_kg_m3, abs=1e-9
    )


def test_the_rest_that_is_less_than_a_parcel_can_go_too():
    bucket, field = fresh()
    entered = dig(bucket, field)
    points, masses = bucket.births(all_of_it=True, rng=np.random.default_rng(0))
    assert masses[-1] < masses[0]
    np.testing.assert_array_equal(points[-1], BUCKET.centroid_t)
    assert masses.sum() == pytest.approx(entered * SAND.density_kg_m3, abs=1e-9)
    assert bucket.waiting_m3 == 0.0
    assert len(bucket.births(all_of_it=True, rng=np.random.default_rng(0))[0]) == 0


def test_a_bucket_takes_no_more_than_its_heap_holds():
    most = heaped_volume_m3(BUCKET, SAND.slope_tan)
    bucket, field = fresh()
    assert dig(bucket, field, load_m3=most - 0.005) == pytest.approx(0.005)
    bucket, field = fresh()
    assert dig(bucket, field, load_m3=most) == 0.0


def test_a_tool_described_anew_in_every_step_is_the_same_bucket():
    bins = []
    for anew in (False, True):
        bucket, field = fresh()
        for tick in range(10):
            tool = tool_at(np.array([0.5 - 0.02 * tick, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
            alike = ToolGeometry(profile_t=BUCKET.profile_t, inner_width_m=BUCKET.inner_width_m)
            bucket.move(dataclasses.replace(tool, geometry=alike) if anew else tool, field, 0.0, 0.0)
        assert bucket.intake is not None
        bins.append(bucket.intake.bins.volumes)
    np.testing.assert_array_equal(bins[0], bins[1])


def test_a_jump_is_refused_however_often_it_is_tried():
    bucket, field = fresh()
    dig(bucket, field)
    before = bucket.pose
    jump = tool_at(np.array([2.5, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
    for _ in range(2):
        with pytest.raises(ConfigurationError, match="tool moved"):
            bucket.move(jump, field, 0.0, 0.0)
        assert bucket.pose is before


def test_what_waits_stays_in_a_bucket_that_goes_away_and_in_one_that_is_exchanged():
    bucket, field = fresh()
    entered = dig(bucket, field)
    bucket.leave(field)
    assert bucket.pose is None
    assert bucket.waiting_m3 == pytest.approx(entered)
    other = ToolGeometry(profile_t=BUCKET.profile_t, inner_width_m=0.5)
    tool = tool_at(np.array([0.0, 0.0, 3.0]), math.pi, np.zeros(3), 0.0)
    bucket.move(dataclasses.replace(tool, geometry=other), field, 0.0, 0.0)
    assert bucket.waiting_m3 == pytest.approx(entered)


def test_a_bucket_that_appears_cuts_nothing_and_one_that_leaves_covers_nothing():
    bucket, field = fresh()
    tool = tool_at(np.array([0.0, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
    heights = field.heights.copy()
    assert bucket.move(tool, field, 0.0, 0.0) == (0.0, 0.0)
    np.testing.assert_array_equal(field.heights, heights)
    assert np.isfinite(field.ceiling).any()
    bucket.leave(field)
    assert np.isinf(field.ceiling).all()
