import dataclasses

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import layout
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, cylinder_from_world, world_from_cylinder
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.operator.cut import FLOOR_CLEARANCE_M
from lerobot_excav.envs.tasks.scoop.operator.dig import plan_dig
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose, line
from lerobot_excav.envs.tasks.scoop.operator.plan import plan_carry, plan_dump
from lerobot_excav.envs.tasks.scoop.operator.reach import joint_pos_near
from lerobot_excav.envs.tasks.scoop.operator.variation import draw_variation
from lerobot_excav.envs.tasks.scoop.scene import SOIL_CELL_SIZE_M, draw_scene
from lerobot_excav.envs.tasks.scoop.targets import Target


@pytest.fixture(scope="module")
def scene():
    return draw_scene("val", 0)


@pytest.fixture(scope="module")
def soil(scene):
    soil = Soil(cell_size_m=SOIL_CELL_SIZE_M)
    soil.reset(scene.heights_m)
    return soil


VARIATIONS = [draw_variation(np.random.default_rng(i), phase_count=7) for i in range(8)]


def test_cylinder_coordinates_round_trip():
    for point_w in np.random.default_rng(0).uniform(-3, 3, (20, 3)):
        radius, swing, height = cylinder_from_world(point_w)
        assert np.allclose(world_from_cylinder(radius, swing), point_w[:2])
        assert height == point_w[2]
    assert cylinder_from_world(np.array([layout.MACHINE_POS_W[0] + 3.0, 0.0, 1.0])) == (3.0, 0.0, 1.0)


@pytest.mark.parametrize("target_id", range(4))
def test_cut_enters_inside_the_patch_goes_towards_the_machine_rolls_in_and_leaves_the_floor(scene, soil, target_id):
    target = scene.targets[target_id]
    for variation in VARIATIONS:
        cut = plan_dig(soil, target, variation).poses
        points_w = np.array([[*world_from_cylinder(p.radius_m, p.swing_rad), p.height_m] for p in cut])
        below = points_w[:, 2] < soil.height_at(points_w[:, :2])
        first = int(np.argmax(below))
        assert below.any()
        assert target.contains(points_w[first])
        assert points_w[:, 2].min() >= FLOOR_CLEARANCE_M - 1e-9
        assert np.all(np.diff([pose.radius_m for pose in cut]) <= 1e-9)
        assert cut[-1].pitch_rad < cut[0].pitch_rad


def test_deeper_style_cuts_deeper_where_there_is_soil():
    soil = Soil(cell_size_m=SOIL_CELL_SIZE_M)
    soil.reset(np.ones_like(soil.heights_m))
    target, style = Target(center_w=np.array([0.5, 0.0, 1.0]), yaw_rad=0.0), VARIATIONS[0]
    depths = [0.35, 0.45]
    cuts = [plan_dig(soil, target, dataclasses.replace(style, depth_m=depth)).poses for depth in depths]
    lowest = [min(pose.height_m for pose in cut) for cut in cuts]
    assert lowest == pytest.approx([0.65, 0.55])


def test_load_is_carried_level_over_the_wall_and_dumped_over_the_box():
    style = VARIATIONS[0]
    start = BucketPose.of_pin(radius_m=4.0, height_m=1.9, pitch_rad=-3.0, swing_rad=0.0)
    carry = plan_carry(start, style)
    assert all(p.pitch_rad == pytest.approx(-3.0) for p in carry)
    dump = plan_dump(carry[-1], style)
    end_w = world_from_cylinder(dump[-1].radius_m, dump[-1].swing_rad)
    assert np.all(np.abs(end_w - TARGET_BOX.center_w[:2]) < TARGET_BOX.half_extent_m)
    assert min(p.height_m for p in dump) > TARGET_BOX.wall_height_m
    for pose in [*carry, *dump]:
        joint_pos_near(pose, keep="pin")


@pytest.mark.parametrize("about_pin", [True, False])
def test_line_starts_and_ends_at_its_ends(about_pin):
    a = BucketPose(radius_m=4.0, height_m=1.0, pitch_rad=-1.5, swing_rad=0.1)
    b = BucketPose(radius_m=3.0, height_m=0.5, pitch_rad=-2.5, swing_rad=0.3)
    poses = line(a, b, about_pin=about_pin)
    for pose, end in ((poses[0], a), (poses[-1], b)):
        assert dataclasses.astuple(pose) == pytest.approx(dataclasses.astuple(end))
