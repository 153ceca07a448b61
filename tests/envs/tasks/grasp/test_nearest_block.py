import mujoco
import numpy as np

from lerobot_excav.envs.machines.fr5.constants import JOINT_NAMES
from lerobot_excav.envs.tasks.grasp.nearest_block import grasp_pos_w, nearest_block
from lerobot_excav.envs.tasks.grasp.scene import draw_scene


def test_the_chain_of_frames_ends_where_the_simulated_gripper_is(workcell):
    workcell.reset(draw_scene("train", 0))
    for joint_pos in np.random.default_rng(0).uniform(-1.5, 1.5, (5, 6)):
        for name, angle in zip(JOINT_NAMES, joint_pos, strict=True):
            workcell.data.joint(name).qpos = angle
        mujoco.mj_forward(workcell.model, workcell.data)
        np.testing.assert_allclose(grasp_pos_w(joint_pos), workcell.grasp_pos_w, atol=1e-9)


def test_the_nearest_block_is_nearest_to_the_gripper_in_the_plane(workcell):
    for scene_id in range(5):
        scene = draw_scene("train", scene_id)
        workcell.reset(scene)
        distance = np.linalg.norm(scene.block_pos_w[:, :2] - workcell.grasp_pos_w[:2], axis=1)
        assert nearest_block(scene) == np.argmin(distance)
    # None is always the nearest.
    assert {nearest_block(draw_scene("train", scene_id)) for scene_id in range(30)} == {0, 1, 2, 3}
