import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.constants import JOINT_RANGE_RAD
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose
from lerobot_excav.envs.tasks.scoop.operator.reach import bucket_pose, joint_pos_near, within_reach

POSES = st.builds(
    BucketPose,
    radius_m=st.floats(0.5, 12.0),
    height_m=st.floats(-5.0, 8.0),
    pitch_rad=st.floats(-3.2, 0.5),
    swing_rad=st.floats(-3.0, 3.0),
)
KEEP = st.sampled_from(["edge", "pin"])


@given(POSES, KEEP)
def test_joints_stay_in_their_ranges_wherever_the_bucket_is_wanted(pose, keep):
    lower, upper = np.array(JOINT_RANGE_RAD).T
    joint_pos = joint_pos_near(pose, keep=keep)
    assert np.all((lower - 1e-9 <= joint_pos) & (joint_pos <= upper + 1e-9))


@given(st.tuples(*(st.floats(low, high) for low, high in JOINT_RANGE_RAD)), KEEP)
def test_a_pose_of_the_machine_is_kept(joint_pos, keep):
    pose = bucket_pose(np.array(joint_pos))
    assume(pose.radius_m > 0.5 and pose.pin_radius_m > 1.0 and pose.pitch_rad > -3.2)
    assert dataclasses.astuple(within_reach(pose, keep=keep)) == pytest.approx(dataclasses.astuple(pose), abs=1e-6)


def test_the_arm_is_stretched_towards_a_point_out_of_reach():
    pose = BucketPose(radius_m=12.0, height_m=1.15, pitch_rad=0.0, swing_rad=0.3)
    kept = within_reach(pose)
    assert kept.swing_rad == pytest.approx(0.3)
    assert joint_pos_near(pose)[2] == pytest.approx(JOINT_RANGE_RAD[2][1])
    assert kept.radius_m > 6.5


def test_a_pin_too_near_to_the_machine_is_brought_as_near_as_the_arm_folds():
    pose = BucketPose.of_pin(radius_m=1.5, height_m=0.9, pitch_rad=-3.0, swing_rad=0.0)
    kept = within_reach(pose, keep="pin")
    assert joint_pos_near(pose, keep="pin")[2] == pytest.approx(JOINT_RANGE_RAD[2][0])
    assert 2.5 < kept.pin_radius_m < 3.2


def test_pitch_gives_way_before_the_edge_does():
    pose = BucketPose(radius_m=6.5, height_m=0.1, pitch_rad=-1.6, swing_rad=0.0)
    kept = within_reach(pose)
    assert (kept.radius_m, kept.height_m) == pytest.approx((6.5, 0.1))
    assert kept.pitch_rad > -1.4
