"""Joystick-rate control that holds: a position servo behind a rate-integrated, slew-limited reference.

A velocity servo drifts at zero command, because it needs a velocity error to carry a load. Here the stick
moves a position reference instead; the servo (in the model) carries the load with a deflection of a few
milliradians and a drift rate of zero. The reference never leads the joint by more than the deflection at which
the servo saturates: like a relief valve, a stalled joint stays stalled without winding up.
"""

from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.errors import ConfigurationError

Array = NDArray[np.float64]

# Position offset at which the stiffness balances the damping of a joint that moves at 1 rad/s.
_VELOCITY_LEAD_S = np.array(const.SERVO_DAMPING_NMS_RAD) / np.array(const.SERVO_STIFFNESS_NM_RAD)
_LOWER_RAD, _UPPER_RAD = np.array(const.JOINT_RANGE_RAD).T.copy()
_ACCEL_RAD_S2 = np.array(const.JOINT_ACCEL_RAD_S2)
_SPEED_RAD_S = np.array(const.JOINT_SPEED_RAD_S)
_DEFLECTION_RAD = float(const.SERVO_DEFLECTION_RAD)


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
    return np.asarray(np.minimum(np.maximum(array, -1.0), 1.0))  # as np.clip, in a third of the time


@kernel
def _clipped(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)


@kernel
def lead_reference(
    reference_pos: Array, reference_vel: Array, set_points: Array, command: Array, joint_pos: Array, dt_s: float
) -> None:
    """Advance the reference by one substep; arguments as in `RateControl.step`, all (4,), the first three change."""
    for joint in range(len(command)):
        lower, upper, accel = _LOWER_RAD[joint], _UPPER_RAD[joint], _ACCEL_RAD_S2[joint]
        pos, vel, measured = reference_pos[joint], reference_vel[joint], joint_pos[joint]
        vel = _clipped(command[joint] * _SPEED_RAD_S[joint], vel - accel * dt_s, vel + accel * dt_s)
        # Towards a joint limit: no faster than can still be stopped at the rated deceleration.
        vel = _clipped(vel, -sqrt(2.0 * accel * max(pos - lower, 0.0)), sqrt(2.0 * accel * max(upper - pos, 0.0)))
        pos = _clipped(pos + vel * dt_s, measured - _DEFLECTION_RAD, measured + _DEFLECTION_RAD)
        pos = _clipped(pos, lower, upper)
        reference_pos[joint], reference_vel[joint] = pos, vel
        set_points[joint] = pos + vel * _VELOCITY_LEAD_S[joint]


class RateControl:
    """Turn rate commands into the set points of the four position servos.

    Attributes:
        reference_pos: Positions that the servos hold [rad], (4,).
        reference_vel: Their rates [rad/s], (4,).
    """

    def __init__(self) -> None:
        self.reference_pos: Array = np.zeros(4)
        self.reference_vel: Array = np.zeros(4)

    def reset(self, joint_pos: ArrayLike) -> None:
        """Hold the given joint positions, shape (4,) [rad], at rest."""
        self.reference_pos[:] = joint_pos
        self.reference_vel[:] = 0.0

    def step(self, command: Array, joint_pos: Array, dt_s: float, set_points: Array) -> None:
        """Advance the reference by one substep, under rate commands in [-1, 1] at measured joint positions [rad].

        Writes the set points of the servos [rad], (4,): the reference plus a velocity lead that cancels the servo's
        damping.
        """
        lead_reference(self.reference_pos, self.reference_vel, set_points, command, joint_pos, dt_s)
