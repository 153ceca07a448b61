import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.bed import lower_bed, supported_height
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.layer import Ground, Layer, Window
from lerobot_excav.envs.soil.momentum import accelerate
from lerobot_excav.envs.soil.parameters import PRESETS
from validation.soil.reference import avalanche
from validation.soil.reference.worlds import flat

SAND = PRESETS["sand"].strength
SLOPE = PRESETS["sand"].slope_tan
CELL, WIDE = 0.05, 0.07
SHAPE = (6, 7)
ALL = Window(0, *SHAPE[:1], 0, SHAPE[1])

seeds = st.integers(0, 2**32 - 1)
borders = st.sampled_from([0.0, 0.3, math.inf])


def random_layer(seed, border):
    """A rough bed with a layer that moves at random, under a ceiling here and there."""
    rng = np.random.default_rng(seed)
    layer = Layer.empty(SHAPE)
    layer.bed[:] = rng.uniform(0.0, 0.6, SHAPE)
    depth = rng.uniform(0.0, 0.2, SHAPE) * (rng.random(SHAPE) < 0.7)
    layer.heights[:] = layer.bed + depth
    layer.ceiling[:] = np.where(rng.random(SHAPE) < 0.2, layer.heights + rng.uniform(-0.05, 0.1, SHAPE), math.inf)
    layer.active[:] = 1
    layer.crept_s[:] = rng.uniform(0.0, 4.0, SHAPE)
    ground = Ground(*SAND, CELL, WIDE, border)
    for axis in range(2):
        for i, j in np.ndindex(SHAPE[0] + 1 - axis, SHAPE[1] + axis):
            before, after = (i - 1 + axis, j - axis), (i, j)
            speed = rng.normal(0.0, 0.7)
            is_inside = min(before) >= 0 and after[0] < SHAPE[0] and after[1] < SHAPE[1]
            if is_inside and rng.random() < 0.7 and depth[before if speed > 0.0 else after] > 0.0:
                layer.speeds[axis, i, j] = speed
                layer.flux[axis, i, j] = speed * depth[before if speed > 0.0 else after]
    return layer, ground


@given(seed=seeds, border=borders)
@settings(max_examples=40)
def test_the_next_speeds_are_those_of_the_reference(seed, border):
    layer, ground = random_layer(seed, border)
    expected = avalanche.next_speeds(layer, ground, 0.004)
    accelerate(layer, ground, ALL, 0.004)
    np.testing.assert_allclose(layer.next_speeds, expected, atol=1e-12)


@given(seed=seeds, border=borders)
@settings(max_examples=40)
def test_a_sub_step_moves_what_the_reference_moves(seed, border):
    layer, ground = random_layer(seed, border)
    layer.bed[:] = np.maximum(layer.bed, 10.0) - 10.0  # on a level floor nothing fails on the way
    layer.heights[:] = layer.bed + np.random.default_rng(seed).uniform(0.01, 0.2, SHAPE)
    layer.crept_s[:] = 0.0  # as in all columns that were changed
    before = layer.heights.copy()
    dt = 1e-4  # shorter than any wave
    speeds = avalanche.next_speeds(layer, ground, dt)
    expected, expected_over = avalanche.moved(layer, ground, speeds, dt)
    over, _ = flow(layer, ground, dt)
    np.testing.assert_allclose(layer.heights, expected, atol=1e-9)
    assert over == pytest.approx(expected_over, abs=1e-9)
    assert layer.heights.sum() + over == pytest.approx(before.sum(), rel=1e-14)


@given(seed=seeds, border=borders)
@settings(max_examples=30)
def test_the_supported_height_is_that_of_the_reference(seed, border):
    support = np.random.default_rng(seed).uniform(0.0, 0.2, SHAPE)
    support[np.random.default_rng(seed + 1).random(SHAPE) < 0.2] = math.inf
    ground = Ground(*SAND, CELL, WIDE, border)
    for i, j in np.ndindex(SHAPE):
        expected = avalanche.supported_height(support, ground, i, j, 0.3)
        assert supported_height(support, ground, i, j, 0.3) == pytest.approx(expected, abs=1e-8)


def test_a_bed_fails_down_to_what_its_neighbours_support_across_the_whole_field():
    layer = Layer.empty((40, 9))
    layer.heights[:20] = layer.bed[:20] = layer.support[:20] = 1.0
    layer.active[:] = 1
    lower_bed(layer, Ground(*SAND, CELL, CELL, math.inf), Window(0, 40, 0, 9))
    expected = np.minimum(1.0, np.maximum(0.0, np.arange(20, -20, -1) * CELL * SLOPE))
    expected[20:] = 0.0
    np.testing.assert_allclose(layer.bed, np.tile(expected[:, None], 9), atol=1e-9)


def run(heights, cell, seconds, dt=0.02, strength=SAND, border=math.inf):
    """Let a field flow; yield its heights and the time after every step."""
    field = HeightField(heights.shape, (cell, cell), border)
    field.reset(heights)
    for k in range(round(seconds / dt)):
        field.flow(dt, strength)
        yield (k + 1) * dt, field.heights


def ridge(azimuth_deg, slope_deg, cell=CELL, extent=4.0, height=0.6):
    """A long ridge whose flanks face an azimuth."""
    count = round(extent / cell)
    x = (np.arange(count) - 0.5 * (count - 1)) * cell
    a = math.radians(azimuth_deg)
    across = np.abs(np.add.outer(x * math.cos(a), x * math.sin(a)))
    return np.maximum(0.0, height - math.tan(math.radians(slope_deg)) * across)


def flank_deg(heights, azimuth_deg, cell=CELL):
    """Slope of the flank of a ridge 0.6 m high, in its middle."""
    field = HeightField(heights.shape, (cell, cell), 0.0)
    field.reset(heights)
    a, line = math.radians(azimuth_deg), np.linspace(0.2, 0.55, 30)
    return -math.degrees(math.atan(np.polyfit(line, field.sample(np.outer(line, [math.cos(a), math.sin(a)])), 1)[0]))


@pytest.mark.parametrize("azimuth_deg", [0.0, 15.0, 22.5, 40.0, 67.5])
def test_a_ridge_a_little_too_steep_comes_to_rest_at_repose_in_every_direction(azimuth_deg):
    *_, (_, heights) = run(ridge(azimuth_deg, 41.0), CELL, 4.0)
    assert flank_deg(heights, azimuth_deg) == pytest.approx(39.0, abs=0.5)


@pytest.mark.parametrize("azimuth_deg", [0.0, 22.5, 40.0, 67.5])
def test_a_ridge_a_little_flatter_than_repose_does_not_move(azimuth_deg):
    start = ridge(azimuth_deg, 38.5)
    *_, (_, heights) = run(start, CELL, 0.2)
    np.testing.assert_array_equal(heights, start)


def pile(seed):
    """Four cones side by side, as steep as repose or up to 3 degrees steeper."""
    rng = np.random.default_rng(seed)
    x, heights = (np.arange(80) - 39.5) * CELL, np.zeros((80, 80))
    for _ in range(4):
        (cx, cy), top, slope_deg = rng.uniform(-0.6, 0.6, 2), rng.uniform(0.6, 1.0), rng.uniform(39.0, 42.0)
        cone = top - math.tan(math.radians(slope_deg)) * np.hypot(x[:, None] - cx, x - cy)
        heights = np.maximum(heights, cone)
    return heights


@pytest.mark.parametrize(
    "start",
    [ridge(22.5, 41.0), ridge(40.0, 41.0), ridge(22.5, 39.6), ridge(11.0, 41.0, 0.1), pile(0), pile(1), pile(2)],
    ids=["22.5", "40", "39.6 degrees", "coarse", "pile 0", "pile 1", "pile 2"],
)
def test_a_slope_at_the_limit_comes_to_exact_rest_and_no_column_stands_much_too_steep(start):
    cell = 4.0 / len(start)
    field = HeightField(start.shape, (cell, cell), math.inf)
    field.reset(start)
    limit_s = 9.0 * math.sqrt(start.max() / 9.81) + 2.0
    for _ in range(math.ceil(limit_s / 0.02)):
        field.flow(0.02, SAND)
    rested = field.heights.tobytes()
    assert not field.active.any()
    field.wake()
    field.flow(0.02, SAND)
    assert field.heights.tobytes() == rested
    assert field.heights.sum() == pytest.approx(start.sum(), rel=1e-12)
    assert math.degrees(math.atan(avalanche.steepest(field.heights, cell))) <= 39.0 + 3.0


def test_a_stop_at_the_outer_faces_is_looked_at_like_one_at_the_others():
    """Speeds die on all four sides of a field of level soil; a mound there would be seen if it were too steep."""
    for axis, face in ((0, (0, 4)), (0, (9, 4)), (1, (4, 0)), (1, (4, 9))):
        layer = Layer.empty((9, 9))
        layer.heights[:], layer.bed[:] = 0.01, 0.0
        layer.speeds[axis][face] = 1e-6
        layer.active[:] = 1
        flow(layer, Ground(*SAND, CELL, CELL, 0.01), 1e-4)
        i, j = min(face[0], 8), min(face[1], 8)
        assert layer.active[i, j], (axis, face)


def wall(height, cell):
    """Half of a strip three columns wide is soil."""
    heights = np.zeros((round(6.0 * height / cell), 3))
    heights[: len(heights) // 2] = height
    return heights


def rest_time(height, cell, dt):
    """Seconds after which no column changes by 2 mm in 0.1 s."""
    start, last, seen = wall(height, cell), 0.0, wall(height, cell)
    for time, heights in run(start, cell, 4.0 * math.sqrt(height), dt):
        if abs(time / 0.1 - round(time / 0.1)) < 1e-6:
            if np.abs(heights - seen).max() >= 0.002:
                last = time
            seen = heights.copy()
    assert heights.sum() == pytest.approx(start.sum(), rel=1e-12)
    return last


def test_a_wall_comes_down_in_a_time_of_gravity_whatever_the_cell_and_the_step():
    cases = {"1 m": (1.0, 0.1, 0.02), "fine": (1.0, 0.04, 0.02), "short": (1.0, 0.1, 0.004), "2 m": (2.0, 0.1, 0.02)}
    times = {name: rest_time(*case) for name, case in cases.items()}
    for name, time in times.items():
        assert time == pytest.approx(3.0 * math.sqrt(cases[name][0] / 9.81), rel=0.3), times


def test_a_collapse_is_the_same_mirrored_and_turned():
    rng = np.random.default_rng(3)
    start = rng.uniform(0.0, 0.8, (18, 14))
    *_, (_, heights) = run(start, CELL, 0.3)
    for change in (lambda h: h[::-1], lambda h: h[:, ::-1], np.transpose):
        *_, (_, other) = run(np.ascontiguousarray(change(start)), CELL, 0.3)
        # beds that fail hold an excess of up to 0.2 mm, which depends on the order
        np.testing.assert_allclose(other, change(heights), atol=0.02)


def test_a_falling_slope_gains_and_keeps_momentum():
    *_, (_, heights) = run(wall(1.0, CELL), CELL, 2.0)
    front = np.flatnonzero(heights[:, 1] > 0.02).max() * CELL - 3.0
    at_repose = math.sqrt(1.0 / SLOPE)  # a triangle of the same volume would reach this far if its slope were repose
    assert front > 1.1 * at_repose


def test_soil_above_a_ceiling_stays_and_soil_below_takes_what_fits():
    field = HeightField((9, 9), (CELL, CELL), 0.0)
    heights = np.zeros((9, 9))
    heights[4, 4], heights[4, 6] = 1.0, 0.5
    field.reset(heights)
    field.ceiling[4, 4:6] = 0.05
    field.flow(3.0, SAND)
    assert field.heights[4, 4] == 1.0
    assert 0.0 < field.heights[4, 5] <= 0.05
    assert field.heights[4, 6] < 0.5


def test_soil_runs_off_an_open_border_and_is_counted():
    field = flat(0.5, 10)
    before = field.volume_m3
    lost = sum(field.flow(0.1, SAND) for _ in range(20))
    assert 0.0 < lost < before
    assert field.volume_m3 + lost == pytest.approx(before, rel=1e-12)


def test_walls_hold_soil_up_to_their_height():
    field = HeightField((10, 10), (CELL, CELL), 0.4)
    field.reset(np.full((10, 10), 0.4))
    assert field.flow(0.1, SAND) == 0.0
    field.reset(np.full((10, 10), 0.9))
    for _ in range(100):
        field.flow(0.1, SAND)
    edge = np.concatenate([field.heights[0], field.heights[-1]])
    assert edge.max() <= 0.4 + 1.02 * SLOPE * CELL
    assert field.heights.min() >= 0.4 - 1e-9


def test_steps_of_any_length_add_up_to_the_same_motion():
    ends = []
    for dt in (0.02, 0.01, 0.0025):
        *_, (_, heights) = run(wall(0.5, CELL), CELL, 1.5, dt)
        ends.append(heights.copy())
    for one, other in itertools.pairwise(ends):
        assert np.abs(one - other).max() < 0.05
