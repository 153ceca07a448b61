"""The nearest region is the one with the shortest swing to the box."""

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, world_from_cylinder
from lerobot_excav.envs.tasks.scoop import stage
from lerobot_excav.envs.tasks.scoop.nearest_region import nearest_target, swings_to_box_rad
from lerobot_excav.envs.tasks.scoop.scene import draw_scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.scoop.stage import draw_start
from lerobot_excav.envs.tasks.scoop.targets import Target


def angle_rad(point_w):
    """Return the angle to a point as the machine sees it; to its left is the box."""
    return np.arctan2(point_w[1] - MACHINE_POS_W[1], point_w[0] - MACHINE_POS_W[0])


class Start:
    """A start with regions at some swing angles [rad], all at one radius."""

    def __init__(self, *swings_rad):
        places_w = world_from_cylinder(5.0, np.array(swings_rad))
        self.targets = tuple(Target(center_w=np.array([*place_w, 0.5]), yaw_rad=0.0) for place_w in places_w)


def test_the_swing_is_counted_from_the_box_to_either_side():
    box_rad = angle_rad(TARGET_BOX.center_w)
    start = Start(box_rad - 1.0, box_rad + 0.25, box_rad - 0.5)
    assert swings_to_box_rad(start) == pytest.approx([1.0, 0.25, 0.5])


def test_it_is_the_shortest_swing_whatever_the_rank_of_the_region(monkeypatch):
    asked = []
    given = {"soil": "gravel", "density": "heavy", "pile": "ridge", "fidelity": "fast"}

    def drawn(*start, **options):
        asked.append((start, options))
        return Start(-0.3, 0.2, 0.1, -0.1)

    monkeypatch.setattr(stage, "draw_start", drawn)
    assert nearest_target(ExcavatorSettings.of({"scene_set": "val", **given}), 7, 3) == 1
    assert asked == [(("val", 7, 3), given)]
    monkeypatch.setattr(stage, "draw_start", lambda *_, **__: Start())
    assert nearest_target(ExcavatorSettings(), 7, 3) == 0


def test_in_drawn_scenes_the_nearest_region_lies_leftmost_towards_the_box():
    nearest = [nearest_target(ExcavatorSettings(), scene_id, 0) for scene_id in range(8)]
    for scene_id, target_id in enumerate(nearest):
        targets = draw_scene("train", scene_id).targets
        assert target_id == max(range(4), key=lambda i: angle_rad(targets[i].center_w))
    assert len(set(nearest)) > 1


def test_a_later_stage_has_its_own_nearest_region_which_is_not_always_the_planners_first():
    start = draw_start("val", 3, 2, fidelity="fast")
    target_id = nearest_target(ExcavatorSettings(scene_set="val", fidelity="fast"), 3, 2)
    assert swings_to_box_rad(start)[target_id] == min(swings_to_box_rad(start))
