"""A motion that begins while the machine is still moving."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.scoop.operator.motion import ACCEL_RAD_S2, JointMotion

Array = NDArray[np.float64]


class MovingStart:
    """A motion from wherever the machine would come to rest, laid over its coming to rest.

    A joint that goes on in its direction slows down in one part of the sum while it speeds up in the other: it keeps
    its speed. Where both would pull the same way, the sum asks for twice the rated acceleration, and the machine would
    overshoot. So the motion waits until a joint stands that has to turn round, and long enough that none is still
    coming to rest when the motion slows down.

    Args:
        joint_pos: Where the joints are, (4,) [rad].
        joint_vel: How fast they are, (4,) [rad/s].
        motion_from: Plans the motion from joint positions (4,) [rad] at which the machine rests.
    """

    def __init__(self, joint_pos: Array, joint_vel: Array, motion_from: Callable[[Array], JointMotion]) -> None:
        self._deceleration = np.sign(joint_vel) * ACCEL_RAD_S2
        self._braking_s = np.abs(joint_vel) / ACCEL_RAD_S2
        stop = joint_pos + 0.5 * joint_vel * self._braking_s
        self._motion = motion_from(stop)
        turns_round = joint_vel * (self._motion.end - stop) < 0.0
        speeds_up_s = np.where(turns_round, 0.0, self._motion.slows_down_s)
        self._wait_s = float(np.max(self._braking_s - speeds_up_s, initial=0.0))
        self.duration_s = max(self._wait_s + self._motion.duration_s, float(np.max(self._braking_s)))

    @property
    def end(self) -> Array:
        """Joint positions at the end of the motion [rad], shape (4,)."""
        return self._motion.end

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Return wanted joint positions [rad] and velocities [rad/s] at a time, each shape (4,)."""
        position, velocity = self._motion.at(time_s - self._wait_s)
        left_s = np.maximum(self._braking_s - max(time_s, 0.0), 0.0)
        return position - 0.5 * self._deceleration * left_s**2, velocity + self._deceleration * left_s
