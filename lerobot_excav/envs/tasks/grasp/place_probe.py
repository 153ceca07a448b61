"""Which block an arm has taken in an episode."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5.layout import NO_BLOCK
from lerobot_excav.envs.tasks.acted_place import ActedPlace
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.spec import TASK_STATE_NAMES

_FIRST = TASK_STATE_NAMES.index("first_grasped_block")


class TakenBlock:
    """Follows one grasp: acting begins when a block is lifted, and the change is the place that it has left.

    Args:
        env: The environment, freshly reset.
    """

    def __init__(self, env: FR5GraspEnv) -> None:
        self._env = env
        self._block_pos_w = env.workcell.block_pos_w.copy()
        self._block = NO_BLOCK
        self._began_w: NDArray[np.float64] = np.zeros(2)

    def update(self) -> None:
        """Take in the frame that has just passed."""
        block = round(float(self._env.task_state[_FIRST]))
        if self._block == NO_BLOCK and block != NO_BLOCK:
            self._block, self._began_w = block, self.tool_pos_w[:2]

    @property
    def tool_pos_w(self) -> NDArray[np.float64]:
        """Point between the fingers (3,) [m], world frame."""
        return np.array(self._env.workcell.grasp_pos_w)

    @property
    def commanded_w(self) -> NDArray[np.float64]:
        """Place of the commanded block at the start (2,) [m], world frame."""
        return self._block_pos_w[self._env.target_id, :2].copy()

    @property
    def has_begun(self) -> bool:
        """Whether a block has been lifted."""
        return self._block != NO_BLOCK

    def acted(self) -> ActedPlace | None:
        """Return where the block stood that was lifted first; None if none was."""
        if self._block == NO_BLOCK:
            return None
        share = float(self._block == self._env.target_id)
        return ActedPlace(began_w=self._began_w, acted_w=self._block_pos_w[self._block, :2].copy(), share=share)
