from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.scoop.cycle import SETTLING_TICKS, DigCycle
from lerobot_excav.envs.tasks.scoop.scene import draw_scene

OVER_BOX = TARGET_BOX.center_w + np.array([0.3, -0.2, 2.5])
OVER_PILE = np.array([0.0, 0.0, 4.0])


def parcels(*positions_w, is_load=False):
    return {
        "parcel_positions_w": np.array(positions_w).reshape(-1, 3),
        "parcel_is_load": np.full(len(positions_w), is_load),
    }


@pytest.fixture(scope="module")
def real_worksite():
    worksite = Worksite()
    worksite.reset(draw_scene("train", 0))
    return worksite


@pytest.fixture
def site(real_worksite):
    """A machine at rest over the pile, and soil and box as a test wants them."""
    flat = {"height_at": lambda xy_w: np.zeros(len(xy_w))}
    soil = SimpleNamespace(payload_mass_kg=0.0, box_mass_kg=0.0, **flat, **parcels())
    return SimpleNamespace(machine=real_worksite.machine, soil=soil)


@pytest.fixture
def cycle(site):
    """A cycle whose bucket has just been emptied into the box."""
    cycle = DigCycle(site, draw_scene("train", 0), target_id=0)
    site.soil.payload_mass_kg = 300.0
    cycle.update()
    site.soil.payload_mass_kg, site.soil.box_mass_kg = 5.0, 295.0
    return cycle


def play(cycle, ticks):
    for _ in range(ticks):
        cycle.update()
    return cycle.is_complete


def test_a_load_that_the_cycle_before_left_in_the_bucket_is_not_loaded_now(site):
    site.soil.payload_mass_kg = 80.0
    cycle = DigCycle(site, draw_scene("train", 0), target_id=0)
    cycle.update()
    assert cycle.target_hit is None
    for payload_kg in (5.0, 80.0):
        site.soil.payload_mass_kg = payload_kg
        cycle.update()
    assert cycle.target_hit is not None
    assert np.array_equal(cycle.onset_w, site.machine.cutting_edge_pos_w)


def test_a_cycle_is_complete_once_the_bucket_has_stayed_empty(cycle):
    assert not play(cycle, SETTLING_TICKS - 1)
    assert play(cycle, 1)


def test_soil_that_still_falls_into_the_box_is_waited_for(cycle, site):
    vars(site.soil).update(parcels(OVER_BOX))
    assert not play(cycle, 2 * SETTLING_TICKS)
    vars(site.soil).update(parcels())
    assert play(cycle, SETTLING_TICKS)


@pytest.mark.parametrize(("place_w", "is_load"), [(OVER_PILE, False), (OVER_BOX, True)], ids=["elsewhere", "load"])
def test_other_soil_is_not_waited_for(cycle, site, place_w, is_load):
    vars(site.soil).update(parcels(place_w, is_load=is_load))
    assert play(cycle, SETTLING_TICKS)


def test_a_bucket_that_loads_again_is_not_empty(cycle, site):
    play(cycle, SETTLING_TICKS - 1)
    site.soil.payload_mass_kg = 50.0
    assert not play(cycle, 1)
    site.soil.payload_mass_kg = 0.0
    assert not play(cycle, SETTLING_TICKS - 1)


def test_the_cycle_reads_the_real_soil(real_worksite):
    cycle = DigCycle(real_worksite, draw_scene("train", 0), target_id=0)
    real_worksite.reset(draw_scene("train", 0))
    assert not cycle._soil_moves_over_box()
    real_worksite.soil.add_parcels(OVER_PILE[None], np.zeros((1, 3)))
    assert not cycle._soil_moves_over_box()
    real_worksite.soil.add_parcels(OVER_BOX[None], np.zeros((1, 3)))
    assert cycle._soil_moves_over_box()
    real_worksite.reset(draw_scene("train", 0))
