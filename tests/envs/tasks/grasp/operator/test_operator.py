import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.constants import HOME_JOINT_POS
from lerobot_excav.envs.machines.fr5.layout import TRAY_POS_W
from lerobot_excav.envs.tasks.grasp.operator.inverse_kinematics import GripperKinematics
from lerobot_excav.envs.tasks.grasp.operator.plan import PHASES, plan_grasp
from lerobot_excav.envs.tasks.grasp.operator.variation import draw_variation


@pytest.mark.parametrize(("scene_id", "fps"), [*((scene_id, 50) for scene_id in range(6)), (1, 25)])
def test_operator_puts_the_commanded_block_into_the_tray(play, scene_id, fps):
    task, _, _ = play(scene_id, scene_id % 4, seed=scene_id, fps=fps, frames=8 * fps)
    assert task.is_success


def test_same_seed_gives_the_same_actions_and_another_seed_others(play):
    first = play(0, 0, seed=5, frames=60)[2]
    assert np.array_equal(first, play(0, 0, seed=5, frames=60)[2])
    assert not np.array_equal(first, play(0, 0, seed=6, frames=60)[2])


def test_inverse_kinematics_reach_every_corner_of_the_work():
    kinematics = GripperKinematics()
    for x, y, z in [(0, 0.4, 0.03), (0.2, 0.4, 0.03), (0, 0.6, 0.03), (0.2, 0.6, 0.03), (*TRAY_POS_W, 0.055)]:
        start = kinematics.start_from(HOME_JOINT_POS)
        for s in np.linspace(0, 1, 50):
            joint_pos = kinematics.joint_pos_at(start + s * (np.array([x, y, z]) - start))
        assert kinematics.start_from(joint_pos) == pytest.approx([x, y, z], abs=5e-4)


def test_plan_begins_where_the_gripper_is_and_passes_block_and_tray():
    rng = np.random.default_rng(0)
    start, block = np.array([0.0, 0.4, 0.33]), np.array([0.1, 0.5, 0.02])
    plan = plan_grasp(start, block, draw_variation(rng, phase_count=len(PHASES)))
    path = np.array([plan.at(t).grasp_pos_w for t in np.arange(0, plan.duration_s, 0.02)])
    assert path[0] == pytest.approx(start)
    assert np.linalg.norm(path - [*block[:2], 0.028], axis=1).min() < 0.01
    assert np.linalg.norm(path[:, :2] - TRAY_POS_W, axis=1).min() < 0.04
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 0.03


def test_every_joint_moves_so_that_its_scale_means_something(play):
    """A joint that stands still up to rounding has no scale by which a policy could normalise it."""
    actions = np.concatenate([play(scene, scene % 4, seed=scene, frames=100)[2] for scene in range(3)])
    assert actions.std(axis=0).min() > 3e-3
