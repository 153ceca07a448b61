"""Joystick-rate control that holds: a position servo behind a rate-integrated, slew-limited reference.

A velocity servo drifts at zero command, because it needs a velocity error to carry a load. Here the stick
moves a position reference instead; the servo (in the model) carries the load with a deflection of a few
milliradians and a drift rate of zero. The reference never leads the joint by more than the deflection at which
the servo saturates: like a relief valve, a stalled joint stays stalled without winding up.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator import constants as const
from lerobot_excav.errors import ConfigurationError

_LOWER, _UPPER = np.array(const.JOINT_RANGE_RAD).T
_SPEED = np.array(const.JOINT_SPEED_RAD_S)
_ACCEL = np.array(const.JOINT_ACCEL_RAD_S2)
_VELOCITY_LEAD_S = np.array(const.SERVO_DAMPING_NMS_RAD) / np.array(const.SERVO_STIFFNESS_NM_RAD)


def checked_action(action: object) -> NDArray[np.float64]:
    """Return an action as float64 (4,), clipped to [-1, 1] as the end stops of a joystick would.

    Raises:
        ConfigurationError: The shape is not (4,) or a value is not finite.
    """
    array = np.asarray(action, dtype=np.float64)
    if array.shape != (4,):
        raise ConfigurationError(
            f"action has shape {array.shape}; allowed: (4,) for {', '.join(const.JOINT_NAMES)}. "
            "Pass one rate command in [-1, 1] per joint."
        )
    if not np.isfinite(array).all():
        raise ConfigurationError(
            f"action={array.tolist()} has a value that is not finite; allowed: numbers in [-1, 1]. "
            "Check the policy or the joystick that produced it."
        )
    return np.clip(array, -1.0, 1.0)


class RateControl:
    """Turn rate commands into the set points of the four position servos.

    Attributes:
        reference_pos: Position that the servos hold, shape (4,) [rad].
        reference_vel: Its rate, shape (4,) [rad/s].
    """

    def __init__(self) -> None:
        self.reference_pos = np.zeros(4)
        self.reference_vel = np.zeros(4)

    def reset(self, joint_pos: NDArray[np.float64]) -> None:
        """Hold the given joint positions, shape (4,) [rad], at rest."""
        self.reference_pos = np.array(joint_pos, dtype=np.float64)
        self.reference_vel = np.zeros(4)

    def step(
        self, action: NDArray[np.float64], joint_pos: NDArray[np.float64], dt_s: float
    ) -> NDArray[np.float64]:
        """Advance the reference by one substep and return the servo set points.

        Args:
            action: Checked rate commands in [-1, 1], shape (4,).
            joint_pos: Measured joint positions, shape (4,) [rad].
            dt_s: Length of the substep [s].

        Returns:
            Set points, shape (4,) [rad]: the reference plus a velocity lead that cancels the servo's damping.
        """
        slew = _ACCEL * dt_s
        vel = self.reference_vel + np.clip(action * _SPEED - self.reference_vel, -slew, slew)
        vel = self._braked(vel)
        pos = self.reference_pos + vel * dt_s
        lead = const.SERVO_DEFLECTION_RAD
        pos = np.minimum(np.maximum(pos, joint_pos - lead), joint_pos + lead)
        self.reference_pos = np.minimum(np.maximum(pos, _LOWER), _UPPER)
        self.reference_vel = vel
        return self.reference_pos + vel * _VELOCITY_LEAD_S

    def _braked(self, vel: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cap the speed towards a joint limit so that it can still be lost at the rated deceleration."""
        to_upper = np.maximum(_UPPER - self.reference_pos, 0.0)
        to_lower = np.maximum(self.reference_pos - _LOWER, 0.0)
        return np.minimum(
            np.maximum(vel, -np.sqrt(2.0 * _ACCEL * to_lower)), np.sqrt(2.0 * _ACCEL * to_upper)
        )
