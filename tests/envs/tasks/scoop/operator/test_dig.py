import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.envs.machines.excavator.layout import SOIL_CELL_SIZE_M, world_from_cylinder
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.operator.dig import LEAST_RADIUS_M, plan_dig
from lerobot_excav.envs.tasks.scoop.operator.plan import plan_curl
from lerobot_excav.envs.tasks.scoop.operator.reach import bucket_pose, joint_pos_near
from lerobot_excav.envs.tasks.scoop.operator.scrape import ROLL_LENGTH_M
from lerobot_excav.envs.tasks.scoop.operator.shell import hang_m
from lerobot_excav.envs.tasks.scoop.operator.variation import draw_variation
from lerobot_excav.envs.tasks.scoop.targets import Target

SOIL = Soil(cell_size_m=SOIL_CELL_SIZE_M)
STYLES = [draw_variation(np.random.default_rng(i), phase_count=7) for i in range(4)]


def target_at(radius_m, swing_rad):
    x, y = world_from_cylinder(radius_m, swing_rad)
    return Target(center_w=np.array([x, y, float(SOIL.height_at([x, y]))]), yaw_rad=swing_rad)


def level_soil(thickness_m):
    SOIL.reset(np.full_like(SOIL.heights_m, thickness_m))


def scraped(thickness_m, *, radius_m=5.5, style=STYLES[0]):
    """Return the poses of a scrape in soil of one thickness, from where the edge is in the soil."""
    level_soil(thickness_m)
    dig = plan_dig(SOIL, target_at(radius_m, 0.0), style)
    assert dig.is_scrape
    return [pose for pose in dig.poses[8:] if pose.pitch_rad > -2.9]


@given(
    seed=st.integers(0, 10_000),
    thickness_m=st.floats(0.0, 1.2),
    radius_m=st.floats(2.9, 6.4),
    swing_rad=st.floats(-0.7, 0.7),
)
@settings(max_examples=60, deadline=None)
def test_any_region_of_any_pile_is_dug_and_curled_within_reach(seed, thickness_m, radius_m, swing_rad):
    rng = np.random.default_rng(seed)
    SOIL.reset(thickness_m * rng.uniform(0.0, 1.0, SOIL.heights_m.shape) ** rng.uniform(0.5, 8.0))
    dig = plan_dig(SOIL, target_at(radius_m, swing_rad), draw_variation(rng, phase_count=7))
    joint_path = [joint_pos_near(pose) for pose in dig.poses]
    joint_path += [joint_pos_near(pose, keep="pin") for pose in plan_curl(bucket_pose(joint_path[-1]))[1:]]
    assert np.abs(np.diff(joint_path, axis=0)).max() < 0.4, "the bucket would jump"
    reached = [bucket_pose(joint_pos) for joint_pos in joint_path]
    assert min(pose.radius_m for pose in reached[: len(dig.poses)]) > LEAST_RADIUS_M - ROLL_LENGTH_M - 0.1
    if dig.is_scrape:
        lowest_m = [pose.height_m - float(hang_m(pose.pitch_rad)) for pose in reached[: len(dig.poses)]]
        assert min(lowest_m) > -1e-3, "the shell would be in the rigid floor"


@pytest.mark.parametrize("thickness_m", [0.04, 0.08, 0.12])
def test_thin_soil_is_scraped_along_the_floor_with_the_belly_off_it(thickness_m):
    on_floor = [pose for pose in scraped(thickness_m) if pose.pitch_rad > -2.3][8:]
    assert len(on_floor) > 10
    for pose in on_floor:
        assert pose.height_m < 0.026
        assert inverse(pose.radius_m, pose.height_m, pose.pitch_rad, pose.swing_rad) is not None


def test_scrape_ends_rolled_in_with_the_belly_where_the_edge_was():
    last = scraped(0.1)[-1]
    assert last.pitch_rad == pytest.approx(STYLES[0].roll_in_pitch_rad, abs=1e-6)
    assert last.height_m - hang_m(last.pitch_rad) == pytest.approx(0.002, abs=2e-3)


def test_thick_soil_is_cut_and_not_scraped():
    level_soil(0.8)
    assert not plan_dig(SOIL, target_at(5.0, 0.0), STYLES[0]).is_scrape


def test_far_entry_is_steep_because_the_arm_is_short_and_a_near_one_flatter():
    far, near = (scraped(0.08, radius_m=radius)[0].pitch_rad for radius in (6.3, 3.3))
    assert near < -1.4 < far


def test_same_style_plans_the_same_dig():
    level_soil(0.1)
    first, again = (plan_dig(SOIL, target_at(5.0, 0.2), STYLES[1]) for _ in range(2))
    assert [dataclasses.astuple(p) for p in first.poses] == [dataclasses.astuple(p) for p in again.poses]
