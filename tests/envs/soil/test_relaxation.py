import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.relaxation import REST_TAN, relax, sweep
from lerobot_excav.errors import ConfigurationError
from validation.soil.reference import avalanche
from validation.soil.reference.worlds import flat

SLOPE = PRESETS["sand"].slope_tan
CELL = 0.05

small_fields = arrays(np.float64, (6, 7), elements=st.floats(0.0, 2.0))
ceilings = arrays(np.float64, (6, 7), elements=st.sampled_from([math.inf, math.inf, 1.0, 0.2, -1.0]))


@given(heights=small_fields, ceiling=ceilings, border=st.sampled_from([0.0, 0.3, math.inf]), wide=st.floats(0.03, 0.08))
@settings(max_examples=60)
def test_a_sweep_is_the_reference_sweep(heights, ceiling, border, wide):
    expected, expected_over = avalanche.sweep(heights, ceiling, (CELL, wide), SLOPE, border)
    active, delta = np.ones(heights.shape, dtype=np.uint8), np.zeros_like(heights)
    over, _ = sweep(heights, delta, active, ceiling, (CELL, wide), SLOPE, border)
    np.testing.assert_allclose(heights, expected, rtol=0, atol=1e-12)
    assert over == pytest.approx(expected_over, abs=1e-12)
    assert not delta.any()


@given(heights=small_fields)
@settings(max_examples=30)
def test_following_only_active_columns_misses_nothing(heights):
    active, delta = np.ones(heights.shape, dtype=np.uint8), np.zeros_like(heights)
    ceiling = np.full(heights.shape, math.inf)
    expected = heights.copy()
    for _ in range(40):
        sweep(heights, delta, active, ceiling, (CELL, CELL), SLOPE, 0.0)
        expected, _ = avalanche.sweep(expected, ceiling, (CELL, CELL), SLOPE, 0.0)
    np.testing.assert_allclose(heights, expected, rtol=0, atol=1e-11)


@given(heights=small_fields)
@settings(max_examples=30)
def test_heights_stay_above_the_floor_and_volume_is_kept(heights):
    rested = relax(heights, CELL, SLOPE)
    assert (rested >= 0).all()
    assert rested.sum() == pytest.approx(heights.sum(), rel=1e-12)
    assert avalanche.steepest(rested, CELL) <= SLOPE + REST_TAN + 1e-9


def test_a_gentle_slope_is_left_alone_byte_for_byte():
    heights = np.add.outer(np.arange(20) * CELL * 0.5, np.zeros(20))
    assert relax(heights, CELL, SLOPE).tobytes() == heights.tobytes()


def test_a_heap_of_485_kg_is_as_high_as_its_cone_and_stands_at_the_repose_angle_in_all_directions():
    volume = 485.0 / 1474.0
    centre, count = 30, 61
    heights = np.zeros((count, count))
    heights[centre - 3 : centre + 4, centre - 3 : centre + 4] = volume / (49 * CELL**2)
    rested = relax(heights, CELL, SLOPE)
    assert rested.sum() * CELL**2 == pytest.approx(volume, rel=1e-9)
    assert rested.max() == pytest.approx((3 * volume * SLOPE**2 / math.pi) ** (1 / 3), rel=0.06)
    field = HeightField((count, count), (CELL, CELL), 0.0)
    field.reset(rested)
    azimuths = np.arange(8) * math.pi / 4
    ways = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1)
    slopes = (field.sample(0.15 * ways) - field.sample(0.55 * ways)) / 0.4
    np.testing.assert_allclose(np.degrees(np.arctan(slopes)), 39.0, atol=2.0)


def test_soil_above_a_ceiling_stays_and_soil_below_takes_what_fits():
    field = HeightField((9, 9), (CELL, CELL), 0.0)
    heights = np.zeros((9, 9))
    heights[4, 4], heights[4, 6] = 1.0, 0.5
    field.reset(heights)
    field.ceiling[4, 4:6] = 0.05
    field.relax(500, SLOPE)
    assert field.heights[4, 4] == 1.0
    assert 0.0 < field.heights[4, 5] <= 0.05
    assert field.heights[4, 6] < 0.5


def test_soil_runs_off_an_open_border_and_is_counted():
    field = flat(0.5, 10)
    before = field.volume_m3
    lost = sum(field.relax(50, SLOPE) for _ in range(40))
    assert 0.0 < lost < before
    assert field.volume_m3 + lost == pytest.approx(before, rel=1e-12)


def test_walls_hold_soil_up_to_their_height():
    field = HeightField((10, 10), (CELL, CELL), 0.4)
    field.reset(np.full((10, 10), 0.4))
    assert field.relax(50, SLOPE) == 0.0
    field.reset(np.full((10, 10), 0.9))
    for _ in range(100):
        field.relax(50, SLOPE)
    edge = np.concatenate([field.heights[0], field.heights[-1]])
    assert edge.max() <= 0.4 + (SLOPE + REST_TAN) * CELL + 1e-9
    assert field.heights.max() > 0.45


@pytest.mark.parametrize("bad", [np.array([[-0.1, 0], [0, 0]]), np.array([[np.nan, 0], [0, 0]])])
def test_bad_heights_are_refused(bad):
    with pytest.raises(ConfigurationError, match="heights_m"):
        relax(bad, CELL, SLOPE)
