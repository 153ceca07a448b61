"""Which block lies nearest to the gripper before anything has moved."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.layout import BASE_POS_W
from lerobot_excav.envs.tasks.grasp.scene import GraspScene, draw_scene


def nearest_block(scene: GraspScene) -> int:
    """Return the index of the block that lies nearest to the grasp point at the start, in the plane of the table.

    Args:
        scene: The scene.
    """
    offset_w = scene.block_pos_w[:, :2] - grasp_pos_w(scene.joint_pos)[:2]
    return int(np.argmin(np.hypot(*offset_w.T)))


def nearest_target(scene_set: str, scene_id: int) -> int:
    """Return the target of a scene that is nearest at the start; it is named by its number."""
    return nearest_block(draw_scene(scene_set, scene_id))


def grasp_pos_w(joint_pos: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the grasp point is, by the chain of the joints' frames.

    Args:
        joint_pos: Joint positions [rad], (6,).

    Returns:
        Position [m], (3,), world frame.
    """
    pos_w = np.array(BASE_POS_W)
    axes_w = np.eye(3)
    for placement, angle in zip(const.JOINT_PLACEMENTS, joint_pos, strict=True):
        pos_w = pos_w + axes_w @ placement.xyz
        axes_w = axes_w @ _turn_x(placement.roll) @ _turn_z(angle)
    return pos_w + axes_w[:, 2] * (const.FLANGE_OFFSET_M + const.PAD_CENTRE_M)


def _turn_x(angle: float) -> NDArray[np.float64]:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])


def _turn_z(angle: float) -> NDArray[np.float64]:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
