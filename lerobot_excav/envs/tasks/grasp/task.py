"""The grasping task: which block was taken, where it lies, and what that is worth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.workcell import Workcell

LIFT_M = 0.02
"""Height above its place on the table from which a block counts as lifted [m] (kind: guess, half its edge)."""
REST_SPEED_M_S = 0.05
"""Speed below which a block rests [m/s] (kind: guess)."""
REST_HEIGHT_TOLERANCE_M = 0.011
"""A block in the tray lies flat or leans on the rim: its centre is this close to its height when flat [m]. Leaning
lifts it by up to 9.4 mm, lying on the rim by the rim's 12 mm (kind: tuned)."""

_STAGES = ("not held", "touched", "lifted", "over the tray", "in the tray")
"""What the rewards of the commanded block mean."""


class GraspTask:
    """Follow one episode.

    Reward per frame, by the first line that holds for the commanded block:

    | reward | state |
    |---|---|
    | 4 | it rests in the tray, released |
    | 3 | the fingers hold it lifted, over the tray |
    | 2 | the fingers hold it lifted |
    | 1 | both fingers touch it |
    | 0 | anything else |

    The published experiment has the same maximum; its policies return 658 (96 % success) and 704 (50 of 50). The
    scripted operator's 400 frames return about 900 here, because it rests longer at the end.

    Args:
        workcell: Arm and blocks, at the start of a scene.
        target_id: Index of the commanded block; also an attribute, which `retarget` changes.
    """

    def __init__(self, workcell: Workcell, target_id: int) -> None:
        self._workcell = workcell
        self.target_id = target_id
        self._first_grasped = layout.NO_BLOCK
        self._return = 0.0
        self._max_reward = 0.0
        self._look()

    def retarget(self, target_id: int) -> None:
        """Command another block from now on; which block is grasped first is asked again."""
        self.target_id = target_id
        self._first_grasped = layout.NO_BLOCK

    def update(self) -> float:
        """Look at the cell after a frame, and return the frame's reward."""
        already_lifted = self._lifted
        self._look()
        lifted = np.flatnonzero(self._lifted & ~already_lifted)
        if self._first_grasped == layout.NO_BLOCK and lifted.size:
            self._first_grasped = int(lifted[0])
        reward = self._reward()
        self._return += reward
        self._max_reward = max(self._max_reward, reward)
        return reward

    @property
    def is_success(self) -> bool:
        """Whether the commanded block rests in the tray, released, and no other is over the tray, however it moves."""
        return bool(self._in_tray[self.target_id]) and int(self._over_tray.sum()) == 1

    @property
    def episode_return(self) -> float:
        """Sum of the rewards so far."""
        return self._return

    @property
    def stage(self) -> str:
        """How far the commanded block has come, in words."""
        return _STAGES[int(self._reward())]

    @property
    def has_wrong_block(self) -> bool:
        """Whether a block is over the tray that was not commanded."""
        return bool(np.delete(self._over_tray, self.target_id).any())

    @property
    def task_state(self) -> NDArray[np.float32]:
        """State of the task, never an input of a policy, (8,) float32; see `spec.TASK_STATE_NAMES`."""
        position_w = self._block_pos_w[self.target_id]
        values = (
            position_w[2] - layout.BLOCK_REST_M,
            np.linalg.norm(position_w - self._workcell.grasp_pos_w),
            np.hypot(*(position_w[:2] - layout.TRAY_POS_W)),
            self._touching[:, self.target_id].sum(),
            self._lifted[self.target_id],
            self._in_tray[self.target_id],
            self._in_tray.sum(),
            self._first_grasped,
        )
        return np.array(values, dtype=np.float32)

    def metrics(self) -> dict[str, Any]:
        """Return the outcome of the episode part by part, as it goes into the metrics file."""
        return {
            "episode_return": self._return,
            "max_reward": self._max_reward,
            "first_grasped_block": self._first_grasped,
            "target_grasped": self._first_grasped == self.target_id,
            "blocks_in_tray": int(self._in_tray.sum()),
            "target_in_tray": bool(self._in_tray[self.target_id]),
            "released": not self._arm_touching[self.target_id],
        }

    def _look(self) -> None:
        cell = self._workcell
        self._touching = cell.fingers_touching()
        self._block_pos_w = cell.block_pos_w
        height = self._block_pos_w[:, 2]
        held = self._touching.all(axis=0)
        self._lifted = held & (height > layout.BLOCK_REST_M + LIFT_M)
        flat = layout.TRAY_HEIGHT_M + layout.BLOCK_REST_M
        self._over_tray = np.array([layout.over_tray(position_w) for position_w in self._block_pos_w])
        self._arm_touching = cell.arm_touching()
        self._in_tray = (
            self._over_tray
            & (np.abs(height - flat) < REST_HEIGHT_TOLERANCE_M)
            & (cell.block_speed < REST_SPEED_M_S)
            & ~self._arm_touching
        )

    def _reward(self) -> float:
        target = self.target_id
        if self._in_tray[target]:
            return 4.0
        if self._lifted[target]:
            return 3.0 if self._over_tray[target] else 2.0
        return 1.0 if self._touching[:, target].all() else 0.0
