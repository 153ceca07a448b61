"""How far from their regions cycles begin."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.tasks.clear.entry_figure import (
    FIRST_CYCLE,
    LATER_CYCLES,
    draw_entries,
    entry_errors_m,
    swing_slope,
)
from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.clear.spec import CYCLES

METRICS = Path("results", "clear", "operator_val.jsonl")


@pytest.fixture(scope="module")
def pile():
    return ClearRecord.model_validate_json(METRICS.read_text().splitlines()[0])


def place_w(radius_m, swing_rad):
    """Return a place before the machine (3,) [m]; the machine looks along x."""
    x_w = MACHINE_POS_W[0] + radius_m * np.cos(swing_rad)
    return (float(x_w), float(MACHINE_POS_W[1] + radius_m * np.sin(swing_rad)), 0.0)


def dug(pile, *cycles):
    """Return a pile with cycles, each a region and an entry as radius [m] and swing [rad], or no entry."""
    first = pile.cycles[0]
    told = [
        first.model_copy(update={"region_w": place_w(*region), "onset_w": None if entry is None else place_w(*entry)})
        for region, entry in cycles
    ]
    return pile.model_copy(update={"cycles": tuple(told)})


def test_errors_are_told_along_the_swing_and_along_the_boom(pile):
    sideways_m, lengthwise_m = entry_errors_m([dug(pile, ((5.0, 0.1), (5.0, 0.2)), ((4.0, 0.3), (4.5, 0.3)))])
    assert sideways_m.shape == lengthwise_m.shape == (1, CYCLES)
    assert sideways_m[0, :2] == pytest.approx([0.5, 0.0], abs=1e-9)
    assert lengthwise_m[0, :2] == pytest.approx([0.0, 0.5])
    assert np.isnan(sideways_m[0, 2:]).all()


def test_a_cycle_without_loading_has_no_error(pile):
    sideways_m, _ = entry_errors_m([dug(pile, ((5.0, 0.1), None), ((5.0, 0.1), (5.0, 0.1)))])
    assert np.isnan(sideways_m[0, 0])
    assert sideways_m[0, 1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("slope", [0.0, 0.5, 1.0])
def test_a_swing_that_goes_part_of_the_way_has_that_slope_in_the_cycles_asked_for(pile, slope):
    told = [((5.0, swing), (4.8, 0.1 + slope * swing)) for swing in (-0.4, -0.1, 0.2, 0.5)]
    first = [dug(pile, cycle, ((5.0, 0.0), (5.0, 3.0))) for cycle in told]
    later = [dug(pile, ((5.0, 0.0), (5.0, 3.0)), *told)]
    assert swing_slope(first, FIRST_CYCLE) == pytest.approx(slope)
    assert swing_slope(later, LATER_CYCLES) == pytest.approx(slope)


def test_without_two_regions_there_is_no_slope(pile):
    assert swing_slope([dug(pile, *[((5.0, 0.1), (5.0, 0.1))] * 3)], LATER_CYCLES) is None
    assert swing_slope([dug(pile)], FIRST_CYCLE) is None


def test_the_picture_is_drawn_of_one_method_of_several_and_of_piles_without_cycles(pile, tmp_path):
    for methods in ({"a": [pile]}, {"a": [pile], "b": [dug(pile)]}):
        draw_entries(methods, tmp_path / "figure.png")
        assert Image.open(tmp_path / "figure.png").width > 800
