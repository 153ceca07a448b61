"""Which block lies nearest to the gripper before anything has moved."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.layout import BASE_POS_W
from lerobot_excav.envs.tasks.grasp.scene import GraspScene, draw_scene
from lerobot_excav.envs.tasks.settings import TaskSettings


def nearest_block(scene: GraspScene) -> int:
    """Return the index of the block that lies nearest to the grasp point at the start, in the plane of the table."""
    offset_w = scene.block_pos_w[:, :2] - grasp_pos_w(scene.joint_pos)[:2]
    return int(np.argmin(np.hypot(*offset_w.T)))


def nearest_target(settings: TaskSettings, scene_id: int, stage: int) -> int:
    """Return the target of a scene that is nearest at the start; it is named by its number."""
    return nearest_block(draw_scene(settings.scene_set, scene_id))


def grasp_pos_w(joint_pos: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where joint positions (6,) [rad] put the grasp point (3,) [m], world frame, by the chain of frames."""
    pos_w = np.array(BASE_POS_W)
    axes_w = np.eye(3)
    for placement, angle in zip(const.JOINT_PLACEMENTS, joint_pos, strict=True):
        pos_w = pos_w + axes_w @ placement.xyz
        axes_w = axes_w @ _turn(0, placement.roll) @ _turn(2, angle)
    return pos_w + axes_w[:, 2] * (const.FLANGE_OFFSET_M + const.PAD_CENTRE_M)


def _turn(axis: int, angle: float) -> NDArray[np.float64]:
    """Return the rotation about a coordinate axis."""
    turned = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned[[i, j], [i, j]] = np.cos(angle)
    turned[j, i], turned[i, j] = np.sin(angle), -np.sin(angle)
    return turned
