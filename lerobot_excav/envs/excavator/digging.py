"""Digging resistance as a dissipative force on the bucket, solved implicitly in every substep."""

from math import tanh

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator import constants as const
from lerobot_excav.envs.soil.tool import Reaction

_NEWTON_STEPS = 50
_SPEED_TOLERANCE = 1e-12


def resisted_speed(free_speed: float, decel: float, scale_speed: float) -> float:
    """Return the speed v' that solves v' + decel tanh(v' / scale_speed) = free_speed.

    The left side grows with v', so there is one solution, of the sign of `free_speed` and smaller than it:
    whatever its size, such a resistance can neither reverse a motion nor chatter.

    Args:
        free_speed: Speed at the end of the step without resistance [m/s].
        decel: Speed that the full resistance would take in the step [m/s].
        scale_speed: Speed at which the resistance is near its full value [m/s].
    """
    if free_speed <= 0.0:
        return free_speed
    # The left side is concave for v' > 0, so Newton's iteration climbs from 0 to the solution from below.
    speed = 0.0
    for _ in range(_NEWTON_STEPS):
        bent = tanh(speed / scale_speed)
        excess = free_speed - speed - decel * bent
        if excess <= _SPEED_TOLERANCE * free_speed:
            break
        speed += excess / (1.0 + decel * (1.0 - bent * bent) / scale_speed)
    return speed


class DiggingResistance:
    """Applies the soil's reaction to the bucket so that it only ever brakes.

    The soil computes its reaction once per tick. Held constant, it would push a bucket backwards that has
    stopped in the meantime. The wrench W of the reaction is scaled with tanh(v / v0), where v is the speed of
    its point of application against W, taken at the END of the substep: v follows from the free motion (motors,
    gravity, inertia) and from the effective mass 1 / (n M^-1 n) that the joints show along W.

    Args:
        model: The compiled machine.

    Attributes:
        scale: Share of the wrench that acts in the current substep, in [0, 1].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._bucket = model.body("bucket").id
        self._added_inertia = const.SUBSTEP_S * np.array(const.SERVO_DAMPING_NMS_RAD)
        self._torque_limit = np.array(const.JOINT_TORQUE_NM)
        self._units = np.eye(model.nv)
        self._jacobian = np.zeros((6, model.nv))
        self._mass_matrix = np.zeros((model.nv, model.nv))
        self._force: NDArray[np.float64]
        self._torque: NDArray[np.float64]
        self.reset()

    def reset(self) -> None:
        """Forget the reactions of the past."""
        self._force, self._torque = np.zeros(3), np.zeros(3)
        self._size_n = 0.0
        self.scale = 0.0

    def set_reaction(self, reaction: Reaction) -> None:
        """Take the wrench about the tool origin that holds for the coming tick.

        It is blended with the one before: the soil's answer depends on the direction in which the edge moves, which
        its own last answer has changed. No resistance takes effect at once.
        """
        share = const.RESISTANCE_BLEND if np.any(reaction.force_w_n) or np.any(reaction.torque_w_nm) else 1.0
        self._force = share * reaction.force_w_n + (1.0 - share) * self._force
        self._torque = share * reaction.torque_w_nm + (1.0 - share) * self._torque
        # The lever turns a wrench that is mostly torque into a speed of the same meaning.
        lever_force = float(np.linalg.norm(self._torque)) / const.BUCKET_LENGTH_M
        self._size_n = max(float(np.linalg.norm(self._force)), lever_force)

    def apply(self, data: mujoco.MjData) -> None:
        """Write the external force of this substep; call it between `mj_step1` and `mj_step2`."""
        wrench = data.xfrc_applied[self._bucket]
        wrench[:] = 0.0
        self.scale = 0.0
        if self._size_n == 0.0:
            return
        self.scale = self._implicit_scale(data)
        if self.scale == 0.0:
            return
        # MuJoCo applies the force at the body's centre of mass: the torque is moved there with it.
        mujoco.mju_cross(wrench[3:], data.xpos[self._bucket] - data.xipos[self._bucket], self._force)
        wrench[:3] = self.scale * self._force
        wrench[3:] = self.scale * (wrench[3:] + self._torque)

    def _implicit_scale(self, data: mujoco.MjData) -> float:
        """Return the fraction of the wrench that acts during this substep, in [0, 1]."""
        dt = const.SUBSTEP_S
        generalized = self._generalized_force(data)
        direction = -generalized / self._size_n
        if float(direction @ data.qvel) < 0.0:
            return 0.0  # already moving with the wrench
        mujoco.mj_fwdActuation(self._model, data)
        drive = data.qfrc_passive + data.qfrc_actuator - data.qfrc_bias
        forces = np.column_stack([drive, generalized])
        response = dt * np.linalg.solve(self._implicit_mass(data), forces)
        free_vel = data.qvel + response[:, 0]
        decel = float(generalized @ response[:, 1]) / self._size_n
        speed = resisted_speed(float(direction @ free_vel), decel, const.RESISTANCE_SPEED_M_S)
        return max(0.0, tanh(speed / const.RESISTANCE_SPEED_M_S))

    def _generalized_force(self, data: mujoco.MjData) -> NDArray[np.float64]:
        mujoco.mj_jacBody(self._model, data, self._jacobian[:3], self._jacobian[3:], self._bucket)
        return self._jacobian[:3].T @ self._force + self._jacobian[3:].T @ self._torque

    def _implicit_mass(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """Return M + dt D: integrated implicitly, a servo's damping acts like inertia, unless it is saturated."""
        for row, unit in zip(self._mass_matrix, self._units, strict=True):
            mujoco.mj_mulM(self._model, data, row, unit)
        is_free = np.abs(data.actuator_force) < self._torque_limit
        return np.asarray(self._mass_matrix + np.diag(is_free * self._added_inertia))
