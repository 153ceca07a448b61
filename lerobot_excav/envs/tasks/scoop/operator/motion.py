"""How joints run through a path in time: briskly, or carefully."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import JOINT_ACCEL_RAD_S2, JOINT_SPEED_RAD_S

Array = NDArray[np.float64]

ACCEL_RAD_S2 = 0.9 * np.asarray(JOINT_ACCEL_RAD_S2)
"""What is used of the rated accelerations: a hand corrects with the rest (kind: tuned)."""
_BEND_SHARE = 0.8
"""Greatest part of the acceleration that goes into a bend of the path (kind: tuned)."""
_PIECES = 4
"""Parts of every leg of a path between two of its points; even."""
_LEAST_CLOCK_S = 1e-6


class JointMotion:
    """A joint path run through within the machine's speeds and accelerations.

    The path is first timed so that the busiest joint runs at full speed, then its clock is started and stopped
    with a ramp long enough for the slowest joint to accelerate. Where the path bends, a joint that has to turn round
    falls behind; the bucket cuts the corner, by centimetres to decimetres. The path is (n, 4) [rad], n >= 2; `speed` is
    the fraction of the machine's speeds to use. From `slows_down_s` on its clock runs slower and slower.
    """

    def __init__(self, path: Sequence[Array] | Array, *, speed: float) -> None:
        self._path = np.asarray(path)
        limit = speed * np.asarray(JOINT_SPEED_RAD_S)
        steps_s = np.maximum(np.max(np.abs(np.diff(self._path, axis=0)) / limit, axis=1), 1e-6)
        self._clock_s = np.concatenate([[0.0], np.cumsum(steps_s)])
        peak_speed = np.max(np.abs(np.diff(self._path, axis=0)) / steps_s[:, None], axis=0)
        ramp_s = float(np.max(peak_speed / ACCEL_RAD_S2))
        span_s = float(self._clock_s[-1])
        # A path shorter than its ramps never gets to full speed: shrink both ramps alike (triangular profile).
        self._top = min(1.0, float(np.sqrt(span_s / ramp_s)))
        self._ramp_s = ramp_s * self._top
        self.duration_s = span_s / self._top + self._ramp_s
        self.slows_down_s = self.duration_s - self._ramp_s

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Return wanted joint positions [rad] and velocities [rad/s] at a time, each shape (4,)."""
        ahead, behind = self._clock_at(time_s + 0.01), self._clock_at(time_s - 0.01)
        return self._positions(self._clock_at(time_s)), (self._positions(ahead) - self._positions(behind)) / 0.02

    @property
    def end(self) -> Array:
        """Joint positions at the end of the path [rad], shape (4,)."""
        return np.asarray(self._path[-1])

    def _clock_at(self, time_s: float) -> float:
        """Position on the path's own clock under a trapezoidal speed profile."""
        t = float(np.clip(time_s, 0.0, self.duration_s))
        ramp, top = self._ramp_s, self._top
        if t < ramp:
            return 0.5 * top * t * t / ramp
        if t > self.duration_s - ramp:
            left = self.duration_s - t
            return float(self._clock_s[-1]) - 0.5 * top * left * left / ramp
        return top * (t - 0.5 * ramp)

    def _positions(self, clock_s: float) -> Array:
        return np.array([np.interp(clock_s, self._clock_s, self._path[:, j]) for j in range(4)])


class CarefulMotion:
    """A joint path run through so that the bucket keeps to it: no joint falls behind another one.

    The path has a clock by which the busiest joint runs at full speed. The pace of that clock, at most 1, is the
    greatest at which every joint can also follow the bends of the path, from rest to rest. (The two passes of
    time-optimal path parametrisation, Bobrow et al. 1985, with bounds on accelerations instead of torques; recalled.)

    The path is (n, 4) [rad], n >= 2; `speed` is the fraction of the machine's speeds to use.
    """

    def __init__(self, path: Sequence[Array] | Array, *, speed: float) -> None:
        self._path = _rounded(np.asarray(path, dtype=np.float64))
        limit = speed * np.asarray(JOINT_SPEED_RAD_S)
        moved = np.diff(self._path, axis=0)
        self._clock_steps_s = np.maximum(np.max(np.abs(moved) / limit, axis=1), _LEAST_CLOCK_S)
        self._slopes = moved / self._clock_steps_s[:, None]
        self._paces = _paces(self._slopes, self._clock_steps_s)
        self._times_s = np.append(0.0, np.cumsum(2.0 * self._clock_steps_s / (self._paces[1:] + self._paces[:-1])))
        self.duration_s = float(self._times_s[-1])

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Return wanted joint positions [rad] and velocities [rad/s] at a time, each shape (4,)."""
        time_s = float(np.clip(time_s, 0.0, self.duration_s))
        k = min(int(np.searchsorted(self._times_s, time_s, side="right")) - 1, len(self._slopes) - 1)
        lasts_s, since_s = self._times_s[k + 1] - self._times_s[k], time_s - self._times_s[k]
        gain = (self._paces[k + 1] - self._paces[k]) / lasts_s
        clock_s = self._paces[k] * since_s + 0.5 * gain * since_s**2
        return self._path[k] + clock_s * self._slopes[k], (self._paces[k] + gain * since_s) * self._slopes[k]

    @property
    def end(self) -> Array:
        """Joint positions at the end of the path [rad], shape (4,)."""
        return np.asarray(self._path[-1])


def _rounded(corners: Array) -> Array:
    """Return a path (n, 4) in more points, with every corner rounded off over the middle halves of its two legs."""
    numbers = np.arange(len(corners))
    steps = np.linspace(0.0, len(corners) - 1.0, _PIECES * (len(corners) - 1) + 1)
    fine = np.stack([np.interp(steps, numbers, joint) for joint in corners.T], axis=-1)
    # Mirrored through its ends, the path keeps them.
    reach = _PIECES // 2
    ahead, behind = 2.0 * fine[0] - fine[reach:0:-1], 2.0 * fine[-1] - fine[-2 : -2 - reach : -1]
    longer = np.concatenate([ahead, fine, behind])
    window = np.full(2 * reach + 1, 1.0 / (2 * reach + 1))
    return np.stack([np.convolve(joint, window, mode="valid") for joint in longer.T], axis=-1)


def _paces(slopes: Array, steps_s: Array) -> Array:
    """Return the pace of the clock at every point of a path (n + 1,), from rest to rest.

    Args:
        slopes: Joint velocities at pace 1 on the pieces of the path, (n, 4) [rad/s].
        steps_s: What the pieces last at pace 1, (n,) [s].
    """
    bends = np.abs(np.diff(slopes, axis=0)) / (0.5 * (steps_s[1:] + steps_s[:-1]))[:, None]
    # What a bend leaves of the acceleration is there to change the pace.
    most = np.min(_BEND_SHARE * ACCEL_RAD_S2 / np.maximum(bends, 1e-9), axis=1)
    squares = np.minimum(1.0, np.concatenate([[0.0], most, [0.0]]))
    bends = np.concatenate([np.zeros((1, 4)), bends, np.zeros((1, 4))])
    left = ACCEL_RAD_S2 - bends * squares[:, None]
    gains = 2.0 * steps_s * np.min(np.minimum(left[1:], left[:-1]) / np.maximum(np.abs(slopes), 1e-9), axis=1)
    for k in range(len(steps_s)):
        squares[k + 1] = min(squares[k + 1], squares[k] + gains[k])
    for k in reversed(range(len(steps_s))):
        squares[k] = min(squares[k], squares[k + 1] + gains[k])
    return np.asarray(np.sqrt(squares))
