"""Joint positions that put the gripper where it is wanted, by differential inverse kinematics (mink)."""

import mink
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.fr5.arm import add_arm
from lerobot_excav.envs.machines.fr5.layout import BASE_POS_W
from lerobot_excav.envs.machines.simulator import mujoco

# Weights of the error in position [1/m] and direction [1/rad], and of the distance from the home pose (kind: tuned:
# the first two decide, the last chooses among what they leave).
_POSITION_COST, _DIRECTION_COST, _POSTURE_COST = 1.0, 0.2, 1e-4
_DAMPING = 1e-6  # keeps the problem regular where the arm is nearly stretched (kind: tuned)
_ITERATIONS = 8
_TOLERANCE_M = 2e-4


class GripperKinematics:
    """Follow positions of the grasp point while the tool turns straight down.

    It is asked for neighbouring positions one after the other and starts each search from the last solution.
    """

    def __init__(self) -> None:
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        wrist = add_arm(spec, BASE_POS_W)
        wrist.add_site(name="grasp", pos=[0.0, 0.0, const.FLANGE_OFFSET_M + const.PAD_CENTRE_M])
        self._configuration = mink.Configuration(spec.compile())
        self._configuration.update(const.HOME_JOINT_POS)
        self._down = self._configuration.get_transform_frame_to_world("grasp", "site").rotation()
        self._start = self._down
        self._gripper = mink.FrameTask("grasp", "site", position_cost=_POSITION_COST, orientation_cost=_DIRECTION_COST)
        posture = mink.PostureTask(self._configuration.model, cost=_POSTURE_COST)
        posture.set_target(const.HOME_JOINT_POS)
        self._tasks = [self._gripper, posture]
        self._limits = [mink.ConfigurationLimit(self._configuration.model)]

    def start_from(self, joint_pos: NDArray[np.float64]) -> NDArray[np.float64]:
        """Begin a motion at joint positions (6,) [rad]; return where the grasp point is there, (3,) [m]."""
        self._configuration.update(joint_pos)
        pose = self._configuration.get_transform_frame_to_world("grasp", "site")
        self._start = pose.rotation()
        return np.array(pose.translation())

    def joint_pos_at(self, grasp_pos_w: NDArray[np.float64], *, upright: float = 1.0) -> NDArray[np.float64]:
        """Return the joint positions (6,) [rad] that bring the grasp point to a position (3,) [m] near the last one.

        Out of reach, the arm comes as near as its joint limits allow. `upright` says how far the tool has turned from
        its direction at the start to straight down, 0 to 1.
        """
        turn = self._start.inverse() @ self._down
        rotation = self._start @ mink.SO3.exp(upright * turn.log())
        self._gripper.set_target(mink.SE3.from_rotation_and_translation(rotation, grasp_pos_w))
        for _ in range(_ITERATIONS):
            # A time step of one second: the velocity is the whole step of a Newton iteration.
            velocity = mink.solve_ik(self._configuration, self._tasks, 1.0, "daqp", _DAMPING, limits=self._limits)
            self._configuration.integrate_inplace(velocity, 1.0)
            if np.linalg.norm(self._gripper.compute_error(self._configuration)) < _TOLERANCE_M:
                break
        return np.array(self._configuration.q)
