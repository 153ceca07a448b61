import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.relaxation import relax
from lerobot_excav.errors import ConfigurationError
from validation.soil.reference.avalanche import steepest

SLOPE = PRESETS["sand"].slope_tan
CELL = 0.05
HOLDS_DEG = 1.0
"""How much steeper than the repose angle a single column may stand at rest."""

small_fields = arrays(np.float64, (6, 7), elements=st.floats(0.0, 2.0))


@given(heights=small_fields)
@settings(max_examples=20)
def test_heights_stay_above_the_floor_and_volume_is_kept(heights):
    rested = relax(heights, CELL, SLOPE)
    assert (rested >= 0).all()
    assert rested.sum() == pytest.approx(heights.sum(), rel=1e-12)
    assert math.degrees(math.atan(steepest(rested, CELL)) - math.atan(SLOPE)) <= HOLDS_DEG


def test_a_gentle_slope_is_left_alone_byte_for_byte():
    heights = np.add.outer(np.arange(20) * CELL * 0.5, np.zeros(20))
    assert relax(heights, CELL, SLOPE).tobytes() == heights.tobytes()


def test_what_has_been_relaxed_does_not_move_in_a_soil():
    rng = np.random.default_rng(4)
    heights = np.zeros((40, 40))
    heights[12:28, 12:28] = rng.uniform(0.0, 0.5, (16, 16))
    soil = Soil("sand", (2.0, 2.0), CELL)
    soil.reset(relax(heights, CELL, SLOPE))
    assert soil.heights_m[0].max() == 0.0  # nothing at the border, where a soil has no walls
    before = soil.heights_m.copy()
    for _ in range(5):
        soil.step(TICK_S)
    np.testing.assert_array_equal(soil.heights_m, before)


def test_a_heap_of_485_kg_stands_at_the_repose_angle_in_all_directions():
    volume = 485.0 / 1474.0
    count = 61
    x = (np.arange(count) - count // 2) * CELL
    radii = np.hypot(*np.meshgrid(x, x))
    cone = np.maximum(0.0, 0.62 - math.tan(math.radians(41.0)) * radii)
    rested = relax(cone * volume / (cone.sum() * CELL**2), CELL, SLOPE)
    assert rested.sum() * CELL**2 == pytest.approx(volume, rel=1e-9)
    field = HeightField((count, count), (CELL, CELL), 0.0)
    field.reset(rested)
    for azimuth in np.radians([0.0, 10.0, 22.5, 37.0, 45.0, 67.5, 115.0, 200.0]):
        way = np.array([math.cos(azimuth), math.sin(azimuth)])
        line = np.linspace(0.15, 0.55, 20)
        slope = -np.polyfit(line, field.sample(line[:, None] * way), 1)[0]
        assert math.degrees(math.atan(slope)) == pytest.approx(39.0, abs=0.5), math.degrees(azimuth)


@pytest.mark.parametrize("bad", [np.array([[-0.1, 0], [0, 0]]), np.array([[np.nan, 0], [0, 0]])])
def test_bad_heights_are_refused(bad):
    with pytest.raises(ConfigurationError, match="heights_m"):
        relax(bad, CELL, SLOPE)
