import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.layout import BASE_POS_W


def flange_pos_b(workcell, joint_pos):
    """Flange position in the base frame [m]."""
    for name, value in zip(const.JOINT_NAMES, joint_pos, strict=True):
        workcell.data.joint(name).qpos = value
    mujoco.mj_kinematics(workcell.model, workcell.data)
    return workcell.data.site("flange").xpos - BASE_POS_W


def denavit_hartenberg(joint_pos):
    """Forward kinematics from the published parameters: a second, independent description of the arm."""
    a, d = [0, -0.425, -0.395, 0, 0, 0], [0.152, 0, 0, 0.102, 0.102, 0.100]
    alpha = np.radians([90, 0, 0, 90, -90, 0])
    pose = np.eye(4)
    for q, a_i, d_i, alpha_i in zip(joint_pos, a, d, alpha, strict=True):
        c, s, ca, sa = np.cos(q), np.sin(q), np.cos(alpha_i), np.sin(alpha_i)
        pose = pose @ [[c, -s * ca, s * sa, a_i * c], [s, c * ca, -c * sa, a_i * s], [0, sa, ca, d_i], [0, 0, 0, 1]]
    return pose[:3, 3]


def test_flange_at_the_zero_pose_is_where_the_datasheet_puts_it(workcell):
    assert flange_pos_b(workcell, np.zeros(6)) == pytest.approx([-0.820, -0.202, 0.050], abs=2e-4)


@pytest.mark.parametrize("seed", range(20))
def test_joint_frames_agree_with_the_denavit_hartenberg_parameters(workcell, seed):
    joint_pos = np.random.default_rng(seed).uniform(*const.JOINT_LIMITS_RAD.T)
    assert flange_pos_b(workcell, joint_pos) == pytest.approx(denavit_hartenberg(joint_pos), abs=5e-4)


def test_tool_points_down_at_home(workcell):
    flange_pos_b(workcell, const.HOME_JOINT_POS)
    assert workcell.data.site("flange").xmat.reshape(3, 3)[:, 2] == pytest.approx([0, 0, -1], abs=1e-9)


def test_arm_weighs_what_the_constants_say_and_gripper_what_its_manual_says(workcell):
    masses = [workcell.model.body(f"link{i + 1}").mass[0] for i in range(6)]
    expected = [const.MASS_SCALE * inertia.mass_kg for inertia in const.LINK_INERTIAS]
    assert masses == pytest.approx(expected, rel=1e-9)
    parts = [workcell.model.body(name).mass[0] for name in ("hand", *const.FINGER_NAMES)]
    assert sum(parts) == pytest.approx(0.43, abs=1e-9)


def test_arm_holds_still_under_gravity(started, scene):
    before = started.joint_pos
    for _ in range(100):
        started.tick(np.append(scene.joint_pos, 1.0))
    assert started.joint_pos == pytest.approx(before, abs=1e-6)
    assert np.abs(started.joint_vel).max() < 1e-6
    assert abs(started.joint_torque[1]) > 10.0  # the drives carry the weight


def test_torques_stay_within_the_datasheet_limits_under_wild_commands(started):
    rng = np.random.default_rng(0)
    for _ in range(60):
        started.tick(np.append(rng.uniform(*const.JOINT_LIMITS_RAD.T), rng.uniform()))
        assert (np.abs(started.joint_torque) <= const.JOINT_TORQUE_N_M + 1e-9).all()


def test_joints_turn_no_faster_than_the_datasheet_allows(started, scene):
    target = np.append(scene.joint_pos + np.array([1.5, 0, 0, 0, 0, -1.5]), 1.0)
    fastest = np.zeros(6)
    for _ in range(40):
        started.tick(target)
        fastest = np.maximum(fastest, np.abs(started.joint_vel))
    assert fastest[0] > 0.9 * const.JOINT_SPEED_RAD_S[0]
    assert (fastest < 1.05 * const.JOINT_SPEED_RAD_S).all()


def test_a_joint_that_was_held_back_does_not_catch_up_beyond_its_speed_limit(started, scene):
    """Wild commands saturate the torque; a reference that ran ahead meanwhile would be chased far too fast."""
    rng = np.random.default_rng(0)
    raised = scene.joint_pos.copy()
    fastest = np.zeros(6)
    for _ in range(40):
        target = np.clip(raised + rng.uniform(-1.5, 1.5, 6), *const.JOINT_LIMITS_RAD.T)
        target[1:3] = raised[1:3] + rng.uniform(-0.3, 0.3, 2)  # high above the table
        for _ in range(3):
            started.tick(np.append(target, 1.0))
            fastest = np.maximum(fastest, np.abs(started.joint_vel))
    assert (fastest < 1.25 * const.JOINT_SPEED_RAD_S).all()
