"""Joystick-rate control that holds: a position servo behind a rate-integrated, slew-limited reference.

A velocity servo drifts at zero command, because it needs a velocity error to carry a load. Here the stick
moves a position reference instead; the servo (in the model) carries the load with a deflection of a few
milliradians and a drift rate of zero. The reference never leads the joint by more than the deflection at which
the servo saturates: like a relief valve, a stalled joint stays stalled without winding up.
"""

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.errors import ConfigurationError

# Position offset at which the stiffness balances the damping of a joint that moves at 1 rad/s.
_VELOCITY_LEAD_S = tuple(
    damping / stiffness
    for damping, stiffness in zip(const.SERVO_DAMPING_NMS_RAD, const.SERVO_STIFFNESS_NM_RAD, strict=True)
)


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
        reference_pos: Positions that the servos hold [rad], one per joint.
        reference_vel: Their rates [rad/s].
    """

    def __init__(self) -> None:
        self.reference_pos = [0.0] * 4
        self.reference_vel = [0.0] * 4

    def reset(self, joint_pos: ArrayLike) -> None:
        """Hold the given joint positions, shape (4,) [rad], at rest."""
        self.reference_pos = np.asarray(joint_pos, dtype=np.float64).tolist()
        self.reference_vel = [0.0] * 4

    def step(self, command: Sequence[float], joint_pos: Sequence[float], dt_s: float) -> list[float]:
        """Advance the reference by one substep, under rate commands in [-1, 1] at measured joint positions [rad].

        Plain floats: four joints are too few for arrays to pay, and this runs in every substep.

        Returns:
            Set points of the servos [rad]: the reference plus a velocity lead that cancels the servo's damping.
        """
        set_points = []
        for joint in range(4):
            lower, upper = const.JOINT_RANGE_RAD[joint]
            accel, measured = const.JOINT_ACCEL_RAD_S2[joint], joint_pos[joint]
            pos, vel = self.reference_pos[joint], self.reference_vel[joint]
            wanted = command[joint] * const.JOINT_SPEED_RAD_S[joint]
            vel = _clipped(wanted, vel - accel * dt_s, vel + accel * dt_s)
            # Towards a joint limit: no faster than can still be stopped at the rated deceleration.
            vel = _clipped(vel, -sqrt(2.0 * accel * max(pos - lower, 0.0)), sqrt(2.0 * accel * max(upper - pos, 0.0)))
            lead = const.SERVO_DEFLECTION_RAD
            pos = _clipped(pos + vel * dt_s, measured - lead, measured + lead)
            pos = _clipped(pos, lower, upper)
            self.reference_pos[joint], self.reference_vel[joint] = pos, vel
            set_points.append(pos + vel * _VELOCITY_LEAD_S[joint])
        return set_points


def _clipped(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)
