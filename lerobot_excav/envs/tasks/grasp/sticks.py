"""The arm's sticks: one moves the gripper over the table, the other lifts and lowers it, opens and closes it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator.inverse_kinematics import GripperKinematics
from lerobot_excav.envs.tasks.sticks import StickResponse

SPEED_M_S = 0.15
"""Speed of the gripper at full deflection [m/s] (kind: tuned by hand; the scripted operator's is up to 0.5)."""

GRIP_RATE = 1.5
"""Part of its stroke that the gripper opens or closes in a second at full deflection [1/s] (kind: tuned by hand)."""

UPRIGHT_S = 1.5
"""Time of motion within which the tool turns from its direction at the start to straight down [s] (kind: tuned)."""

LEAD_M = 0.03
"""How far the commanded place may run ahead of the gripper [m]: what blocks it is not pressed harder (kind: guess)."""

LOW_W, HIGH_W = np.array([0.1, -0.6, 0.005]), np.array([0.85, 0.6, 0.6])
"""Corners of the space in which the gripper is led, world frame [m] (kind: guess)."""

_AXES = {
    "iso": ("left_y", "left_x", "right_y", "right_x"),
    "sae": ("right_y", "right_x", "left_y", "left_x"),
}
_MOTIONS = (("away", "back"), ("left", "right"), ("down", "up"), ("close", "open"))


class GraspSticks:
    """Leads the gripper; inverse kinematics finds the joint positions. Both patterns differ in which hand does what."""

    legend = {pattern: dict(zip(axes, _MOTIONS, strict=True)) for pattern, axes in _AXES.items()}  # noqa: RUF012

    def __init__(self) -> None:
        self._kinematics = GripperKinematics()

    def reset(self, env: FR5GraspEnv) -> None:
        """Begin at the arm's present position and grip."""
        self._cell, self._step_s = env.workcell, 1.0 / env.fps
        self._place_w = self._kinematics.start_from(self._cell.joint_pos)
        self._upright = 0.0
        self._action = np.asarray(self._cell.reference, np.float32)

    def action(self, axes: Mapping[str, float], response: StickResponse) -> NDArray[np.float32]:
        """Return joint position targets [rad] and the gripper's target [0..1], (7,)."""
        back, right, up, opening = (response.of(axes, axis) for axis in _AXES[response.pattern])
        if back or right or up:
            motion_w = SPEED_M_S * self._step_s * np.array([-back, -right, up])
            ahead_w = np.clip(self._place_w + motion_w, LOW_W, HIGH_W) - self._cell.grasp_pos_w
            length_m = float(np.linalg.norm(ahead_w))
            self._place_w = self._cell.grasp_pos_w + ahead_w * min(1.0, LEAD_M / max(length_m, 1e-9))
            self._upright = min(1.0, self._upright + self._step_s / UPRIGHT_S)
            self._action[:6] = self._kinematics.joint_pos_at(self._place_w, upright=self._upright)
        self._action[6] = np.clip(self._action[6] + GRIP_RATE * self._step_s * opening, 0.0, 1.0)
        return self._action.copy()
