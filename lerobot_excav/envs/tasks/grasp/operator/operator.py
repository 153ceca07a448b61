"""The scripted operator: fetches any block of any scene by joint position targets."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator.inverse_kinematics import GripperKinematics
from lerobot_excav.envs.tasks.grasp.operator.plan import PHASES, plan_grasp
from lerobot_excav.envs.tasks.grasp.operator.variation import draw_variation


class GraspOperator:
    """Grasps the commanded block and puts it into the tray.

    It sees where the block lies and plans way-points, whose path inverse kinematics turns into joint position targets;
    way-points and pace, drawn from `rng`, differ from grasp to grasp. A new command makes it plan again, with open
    fingers: what they hold by then falls.
    """

    def __init__(self, *, rng: np.random.Generator) -> None:
        self._rng = rng
        self._kinematics = GripperKinematics()

    def reset(self, env: FR5GraspEnv) -> None:
        """Plan the grasp of the block that an environment, in any state of its episode, commands now."""
        variation = draw_variation(self._rng, phase_count=len(PHASES))
        cell = env.workcell
        start_pos_w = self._kinematics.start_from(cell.joint_pos)
        self._target_id = env.target_id
        self._plan = plan_grasp(start_pos_w, cell.block_pos_w[self._target_id], variation)
        self._ticks = 0

    @property
    def approach_s(self) -> float:
        """How long after the newest command the fingers begin to close [s]."""
        return self._plan.grip_s

    def act(self, env: FR5GraspEnv) -> NDArray[np.float32]:
        """Return the action of the next frame: joint position targets [rad] and opening [0..1], (7,) float32."""
        if env.target_id != self._target_id:
            self.reset(env)
        # Ticks of a frame are whole: the environment accepts no other frame rates.
        for _ in range(round(1.0 / (TICK_S * env.fps))):
            self._ticks += 1
            command = self._plan.at(self._ticks * TICK_S)
            joint_pos = self._kinematics.joint_pos_at(command.grasp_pos_w, upright=command.upright)
        return np.append(joint_pos, command.opening).astype(np.float32)
