import dataclasses

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.planner.full_view import propose_regions
from lerobot_excav.envs.tasks.scoop import stage
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.envs.tasks.scoop.scene import draw_scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.scoop.stage import dig_cycle, draw_start, operator_rng, settle, start_of

SCENE = ("val", 3)
ARRAYS = ("joint_pos", "heights_m", "firm_heights_m", "box_heights_m")


def start_at(number, **options):
    return draw_start(*SCENE, number, fidelity="fast", **options)


def started(start):
    worksite = Worksite(fidelity="fast")
    worksite.reset(start)
    return worksite


@pytest.fixture(scope="module")
def starts():
    return [start_at(number) for number in range(3)]


def test_stage_0_is_the_scene_itself():
    assert start_at(0) is draw_scene(*SCENE, soil="sand", pile="heaps")


@pytest.mark.parametrize("given", [{"soil": "gravel"}, {"pile": "ridge"}, {"scene_set": "val"}])
def test_a_start_is_of_the_scene_set_the_soil_and_the_pile_of_the_settings(given):
    usual, asked = (start_of(ExcavatorSettings.of(settings), 1, 0) for settings in ({}, given))
    assert not np.array_equal(usual.heights_m, asked.heights_m)


@pytest.mark.slow
def test_a_later_start_is_of_the_soil_the_density_the_pile_and_the_fidelity_of_the_settings():
    given = {"soil": "gravel", "density": "heavy", "pile": "two_heaps", "fidelity": "fast"}
    settings = ExcavatorSettings.of(given)
    start = start_of(settings, 1, 1)
    assert start is draw_start(settings.scene_set, 1, 1, **given)
    usual = start_of(ExcavatorSettings.of({**given, "density": "usual"}), 1, 1)
    assert not np.array_equal(start.heights_m, usual.heights_m)


def test_a_pile_is_the_same_whatever_its_density_is():
    light, heavy = (start_of(ExcavatorSettings.of({"density": density}), 1, 0) for density in ("light", "heavy"))
    assert light is heavy


@pytest.mark.slow
def test_stages_are_drawn_once_and_the_same_again(starts):
    assert start_at(2) is starts[2]
    stage._later_start.cache_clear()
    again = start_at(2)
    assert again is not starts[2]
    for name in ARRAYS:
        assert getattr(again, name).tobytes() == getattr(starts[2], name).tobytes()
    assert [t.center_w.tobytes() for t in again.targets] == [t.center_w.tobytes() for t in starts[2].targets]


def test_a_stage_is_the_one_before_and_one_cycle_of_the_same_operator(starts):
    worksite = started(starts[1])
    target = propose_regions(worksite)[0]
    assert np.array_equal(target.center_w, starts[1].targets[0].center_w)
    scene = dataclasses.replace(starts[1], targets=(target,))
    cycle = dig_cycle(worksite, scene, DigOperator(rng=operator_rng(*SCENE, 2)))
    settle(worksite)
    assert cycle.is_complete
    assert worksite.soil.heights_m.tobytes() == starts[2].heights_m.tobytes()
    assert worksite.machine.joint_pos.tobytes() == starts[2].joint_pos.tobytes()


def test_no_soil_is_lost_between_two_stages(starts):
    soils = [started(start).soil for start in starts]
    for soil, before in zip(soils[1:], soils[:-1], strict=True):
        ledger, total_kg = soil.ledger_kg(), sum(before.ledger_kg().values())
        assert ledger["parcels"] == ledger["bucket"] == ledger["out_of_bounds"] == 0.0
        assert ledger["box"] > before.ledger_kg()["box"] + 200.0
        assert total_kg - 60.0 < ledger["grid"] + ledger["box"] <= total_kg + 1e-6


def test_a_later_start_lies_still_and_begins_where_the_machine_has_dumped(starts):
    worksite = started(starts[2])
    for _ in range(25):
        worksite.tick(np.zeros(4))
    assert np.abs(worksite.soil.heights_m - starts[2].heights_m).max() < 2e-3
    assert starts[2].joint_pos[0] > 1.2


def test_other_regions_give_another_start():
    def last_of_all(worksite):
        return propose_regions(worksite)[::-1]

    assert not np.array_equal(start_at(1, propose=last_of_all).heights_m, start_at(1).heights_m)


def test_regions_are_as_many_as_a_scene_has_and_the_best_comes_first(starts):
    for start in starts[1:]:
        assert len(start.targets) == len(starts[0].targets)
        centers_w = np.array([target.center_w[:2] for target in start.targets])
        apart_m = np.linalg.norm(centers_w[:, None] - centers_w[None], axis=-1)[np.triu_indices(len(centers_w), 1)]
        assert apart_m.min() >= 0.5
