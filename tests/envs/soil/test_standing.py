import math

import numpy as np
import pytest

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import PRESETS, Soil
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import Strength

CRITICAL_M = {"dirt": 1.245, "wet_sand": 2.548}
"""4 c / gamma tan(45 deg + phi / 2), worked out by hand from 2100 and 5000 Pa, 1474 kg/m3, 39.98 and 33.00 degrees."""


def cut(height, cell, azimuth_deg, margin=1.0):
    """Heights of a vertical cut that faces an azimuth."""
    count = 2 * math.ceil((0.8 * height + margin) / cell)
    x = (np.arange(count) - 0.5 * (count - 1)) * cell
    a = math.radians(azimuth_deg)
    return np.where(np.add.outer(x * math.cos(a), x * math.sin(a)) < 0.0, height, 0.0)


def after(heights, cell, strength, seconds=0.3):
    """The field some time later."""
    field = HeightField(heights.shape, (cell, cell), math.inf)
    field.reset(heights)
    for _ in range(round(seconds / TICK_S)):
        field.flow(TICK_S, strength)
    return field


@pytest.mark.parametrize(("preset", "cell"), [("dirt", 0.05), ("dirt", 0.1), ("wet_sand", 0.1)])
@pytest.mark.parametrize("azimuth_deg", [0.0, 22.5, 33.0, 250.0])
def test_a_cut_stands_up_to_its_critical_height_and_fails_beyond(preset, cell, azimuth_deg):
    strength = PRESETS[preset].strength
    low = cut(0.95 * CRITICAL_M[preset], cell, azimuth_deg)
    np.testing.assert_array_equal(after(low, cell, strength).heights, low)
    high = cut(1.1 * CRITICAL_M[preset], cell, azimuth_deg)
    assert np.abs(after(high, cell, strength).heights - high).max() > 0.5


@pytest.mark.parametrize("preset", CRITICAL_M)
def test_a_low_cut_stands_on_end(preset):
    heights = cut(0.2, 0.05, 67.5)
    np.testing.assert_array_equal(after(heights, 0.05, PRESETS[preset].strength).heights, heights)


def test_a_face_of_60_degrees_stands_higher_than_a_vertical_one():
    weak = Strength(math.tan(math.radians(38.0)), 0.05, 1.0)
    vertical, sloping = 0.41, 1.87  # Culmann, by hand
    for azimuth_deg in (0.0, 22.5):
        heights = cut(1.2 * vertical, 0.05, azimuth_deg)
        assert np.abs(after(heights, 0.05, weak).heights - heights).max() > 0.1
        for share, fails in ((0.75, False), (1.2, True)):
            height = share * sloping
            count = 2 * math.ceil((height + 1.0) / 0.05)
            x, a = (np.arange(count) - 0.5 * (count - 1)) * 0.05, math.radians(azimuth_deg)
            across = np.add.outer(x * math.cos(a), x * math.sin(a))
            heights = np.clip(0.5 * height - across * math.tan(math.radians(60.0)), 0.0, height)
            assert (np.abs(after(heights, 0.05, weak).heights - heights).max() > 0.1) == fails


def test_what_has_failed_has_swelled_lies_at_repose_and_weighs_the_same():
    strength = PRESETS["dirt"].strength
    heights = cut(1.5, 0.05, 22.5, margin=1.5)
    field = after(heights, 0.05, strength, 3.0)
    loose = field.heights - field.layer.firm
    assert loose.min() >= 0.0
    firm_m3, loose_m3 = field.layer.firm.sum() * 0.0025, loose.sum() * 0.0025
    assert firm_m3 + loose_m3 / 1.1 == pytest.approx(heights.sum() * 0.0025, rel=1e-12)
    assert field.volume_m3 == pytest.approx(heights.sum() * 0.0025 + loose_m3 / 11.0, rel=1e-12)
    assert loose_m3 > 0.3
    slopes = np.hypot(*np.gradient(field.heights, 0.05))
    lies = (loose > 0.1)[1:-1, 1:-1] & (loose > 0.1)[2:, 1:-1] & (loose > 0.1)[:-2, 1:-1]
    lies &= (loose > 0.1)[1:-1, 2:] & (loose > 0.1)[1:-1, :-2]
    assert np.quantile(slopes[1:-1, 1:-1][lies], 0.99) <= strength.slope_tan * 1.05


@pytest.mark.parametrize("preset", ["dirt", "wet_sand"])
def test_soil_that_lands_stays_loose(preset):
    soil = Soil(preset, (3.0, 3.0), fidelity="fast")
    points = np.array([[0.0, 0.1 * k, 0.3] for k in range(-3, 4)])
    soil.add_parcels(points, np.zeros_like(points))
    for _ in range(150):
        soil.step(TICK_S)
    assert len(soil.parcel_positions_w) == 0
    ledger, parameters = soil.ledger_kg(), soil.parameters
    assert ledger["grid"] == pytest.approx(7 * soil.parcel_mass_kg, rel=1e-12)
    volume = float(soil.heights_m.sum()) * 0.05**2
    assert volume == pytest.approx(parameters.swell * ledger["grid"] / parameters.density_kg_m3, rel=1e-9)
