"""Paths of the bucket in the machine's cylinder coordinates, and the joint motions that follow them in time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_LENGTH_M, JOINT_ACCEL_RAD_S2, JOINT_SPEED_RAD_S
from lerobot_excav.envs.machines.excavator.kinematics import inverse
from lerobot_excav.errors import ExcavError

_PITCH_SEARCH_RAD = np.arange(0.0, 1.3, 0.04)


class UnreachableError(ExcavError):
    """The bucket cannot be brought to a wanted pose."""


@dataclass(frozen=True, kw_only=True)
class BucketPose:
    """Pose of the bucket in the machine's cylinder coordinates."""

    radius_m: float  # cutting edge, from the swing axis
    height_m: float  # cutting edge, above the floor
    pitch_rad: float  # chord from pin to edge against the horizontal, upwards positive
    swing_rad: float  # swing angle

    @classmethod
    def of_pin(cls, *, radius_m: float, height_m: float, pitch_rad: float, swing_rad: float) -> "BucketPose":
        """Make the pose from the place of the bucket pin instead of the edge."""
        return cls(
            radius_m=radius_m + BUCKET_LENGTH_M * float(np.cos(pitch_rad)),
            height_m=height_m + BUCKET_LENGTH_M * float(np.sin(pitch_rad)),
            pitch_rad=pitch_rad,
            swing_rad=swing_rad,
        )

    @property
    def pin_radius_m(self) -> float:
        """Bucket pin, from the swing axis [m]."""
        return self.radius_m - BUCKET_LENGTH_M * float(np.cos(self.pitch_rad))

    @property
    def pin_height_m(self) -> float:
        """Bucket pin, above the floor [m]."""
        return self.height_m - BUCKET_LENGTH_M * float(np.sin(self.pitch_rad))


def line(start: BucketPose, end: BucketPose, *, about_pin: bool, samples: int = 24) -> list[BucketPose]:
    """Interpolate two poses, with the bucket pin (or else the cutting edge) on a straight line in the cylinder."""

    def numbers(pose: BucketPose) -> NDArray[np.float64]:
        place = (pose.pin_radius_m, pose.pin_height_m) if about_pin else (pose.radius_m, pose.height_m)
        return np.array([*place, pose.pitch_rad, pose.swing_rad])

    poses = []
    for s in np.linspace(0.0, 1.0, samples):
        radius, height, pitch, swing = ((1 - s) * numbers(start) + s * numbers(end)).tolist()
        make = BucketPose.of_pin if about_pin else BucketPose
        poses.append(make(radius_m=radius, height_m=height, pitch_rad=pitch, swing_rad=swing))
    return poses


def joint_pos_near(pose: BucketPose, *, keep: str = "edge") -> NDArray[np.float64]:
    """Solve for the joints (4,) [rad], giving way in pitch where the wanted one is out of reach.

    Args:
        pose: Wanted pose.
        keep: What stays in place when the pitch gives way: the cutting `edge` or the bucket `pin`.

    Raises:
        UnreachableError: No pitch within 1.3 rad brings the bucket there.
    """
    for deviation in _PITCH_SEARCH_RAD:
        for sign in (1.0, -1.0):
            pitch = pose.pitch_rad + sign * float(deviation)
            radius, height = pose.radius_m, pose.height_m
            if keep == "pin":
                radius = pose.pin_radius_m + BUCKET_LENGTH_M * float(np.cos(pitch))
                height = pose.pin_height_m + BUCKET_LENGTH_M * float(np.sin(pitch))
            joint_pos = inverse(radius_m=radius, height_m=height, pitch_rad=pitch, swing_rad=pose.swing_rad)
            if joint_pos is not None:
                return joint_pos
    raise UnreachableError(f"the bucket cannot reach {pose}")


class JointMotion:
    """A joint path run through within the machine's speeds and accelerations.

    The path is first timed so that the busiest joint runs at full speed, then its clock is started and stopped
    with a ramp long enough for the slowest joint to accelerate. The path is (n, 4) [rad], n >= 2; `speed` is the
    fraction of the machine's speeds to use.
    """

    def __init__(self, path: Sequence[NDArray[np.float64]] | NDArray[np.float64], *, speed: float) -> None:
        self._path = np.asarray(path)
        limit = speed * np.asarray(JOINT_SPEED_RAD_S)
        steps_s = np.maximum(np.max(np.abs(np.diff(self._path, axis=0)) / limit, axis=1), 1e-6)
        self._clock_s = np.concatenate([[0.0], np.cumsum(steps_s)])
        peak_speed = np.max(np.abs(np.diff(self._path, axis=0)) / steps_s[:, None], axis=0)
        ramp_s = float(np.max(peak_speed / (0.9 * np.asarray(JOINT_ACCEL_RAD_S2))))
        span_s = float(self._clock_s[-1])
        # A path shorter than its ramps never gets to full speed: shrink both ramps alike (triangular profile).
        self._top = min(1.0, float(np.sqrt(span_s / ramp_s)))
        self._ramp_s = ramp_s * self._top
        self.duration_s = span_s / self._top + self._ramp_s

    def at(self, time_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return wanted joint positions [rad] and velocities [rad/s] at a time, each shape (4,)."""
        ahead, behind = self._clock_at(time_s + 0.01), self._clock_at(time_s - 0.01)
        return self._positions(self._clock_at(time_s)), (self._positions(ahead) - self._positions(behind)) / 0.02

    @property
    def end(self) -> NDArray[np.float64]:
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

    def _positions(self, clock_s: float) -> NDArray[np.float64]:
        return np.array([np.interp(clock_s, self._clock_s, self._path[:, j]) for j in range(4)])
