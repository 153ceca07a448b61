import dataclasses
import math

import numpy as np
import pytest

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.soil.bucket import Bucket, heaped_volume_m3
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.tool import ToolGeometry
from lerobot_excav.errors import ConfigurationError
from validation.soil.reference.worlds import flat

SAND = PRESETS["sand"]


def fresh():
    return Bucket(SAND, FIDELITIES["standard"]), flat(0.8, 60)


def dragged(tick):
    return tool_at(np.array([0.5 - 0.02 * tick, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)


def dig(bucket, field, load_m3=0.0):
    """Drag the bucket through the ground; return the volume that entered."""
    return sum(bucket.move(dragged(tick), field, 0.0, load_m3)[0] for tick in range(30))


def fresh_cut(load_m3):
    """Return the volume that enters a bucket with a load over 2 cm, in the middle of a drag."""
    bucket, field = fresh()
    for tick in range(15):
        bucket.move(dragged(tick), field, 0.0, 0.0)
        bucket.births(all_of_it=True, rng=np.random.default_rng(0))
    return bucket.move(dragged(15), field, 0.0, load_m3)[0]


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


@pytest.mark.parametrize("all_of_it", [False, True])
def test_what_enters_waits_and_what_waits_is_born(all_of_it):
    """With the rest that is less than a parcel, or without it."""
    bucket, field = fresh()
    volume = field.volume_m3
    entered = dig(bucket, field)
    assert entered > 0.01
    assert bucket.waiting_m3 == pytest.approx(entered)
    assert field.volume_m3 + entered == pytest.approx(volume)
    points, masses = bucket.births(all_of_it=all_of_it, rng=np.random.default_rng(0))
    whole = SAND.parcel_mass_kg(FIDELITIES["standard"].parcel_radius_m)
    count, total = int(entered * SAND.density_kg_m3 / whole), entered * SAND.density_kg_m3
    assert len(points) == len(masses) == count + all_of_it
    np.testing.assert_allclose(masses[:count], whole)
    assert masses.sum() + bucket.waiting_m3 * SAND.density_kg_m3 == pytest.approx(total, abs=1e-9)
    if all_of_it:
        assert masses[-1] < whole
        np.testing.assert_array_equal(points[-1], BUCKET.centroid_t)
        assert bucket.waiting_m3 == 0.0
        assert len(bucket.births(all_of_it=True, rng=np.random.default_rng(0))[0]) == 0


def test_a_bucket_takes_ever_less_around_its_heaped_volume_and_then_none():
    heap = heaped_volume_m3(BUCKET, SAND.slope_tan)
    shares = (0.5, 0.9, 0.975, 1.0, 1.025, 1.05, 1.2)
    entered = [fresh_cut(share * heap) for share in shares]
    assert entered[0] == entered[1] > 0.0
    assert entered[2:] == pytest.approx([share * entered[0] for share in (0.75, 0.5, 0.25, 0.0, 0.0)], rel=0.1)
    assert dig(*fresh(), load_m3=heap) == pytest.approx(0.05 * heap, rel=0.05)  # nearly all that is left, however far


def test_a_tool_that_is_described_again_in_every_step_is_the_same_bucket():
    bins = []
    for again in (False, True):
        bucket, field = fresh()
        for tick in range(10):
            geometry = dataclasses.replace(BUCKET) if again else BUCKET
            bucket.move(dataclasses.replace(dragged(tick), geometry=geometry), field, 0.0, 0.0)
        bins.append(bucket.intake.bins.volumes)
    np.testing.assert_array_equal(*bins)


def test_a_jump_is_refused_however_often_it_is_tried():
    bucket, field = fresh()
    dig(bucket, field)
    before = bucket.pose
    jump = tool_at(np.array([2.5, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
    for _ in range(2):
        with pytest.raises(ConfigurationError, match="tool moved"):
            bucket.move(jump, field, 0.0, 0.0)
        assert bucket.pose is before


def test_a_bucket_that_appears_cuts_nothing_and_one_that_leaves_covers_nothing():
    bucket, field = fresh()
    tool = tool_at(np.array([0.0, 0.0, 0.4]), math.radians(-120), np.zeros(3), 0.0)
    heights = field.heights.copy()
    assert bucket.move(tool, field, 0.0, 0.0) == (0.0, 0.0)
    np.testing.assert_array_equal(field.heights, heights)
    assert np.isfinite(field.ceiling).any()
    bucket.leave(field)
    assert np.isinf(field.ceiling).all()


def test_what_waits_stays_in_a_bucket_that_goes_away_and_in_one_that_is_exchanged():
    bucket, field = fresh()
    entered = dig(bucket, field)
    bucket.leave(field)
    assert bucket.pose is None
    assert bucket.waiting_m3 == pytest.approx(entered)
    other = dataclasses.replace(BUCKET, inner_width_m=0.5)
    tool = tool_at(np.array([0.0, 0.0, 3.0]), math.pi, np.zeros(3), 0.0)
    bucket.move(dataclasses.replace(tool, geometry=other), field, 0.0, 0.0)
    assert bucket.waiting_m3 == pytest.approx(entered)
