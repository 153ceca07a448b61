"""Paths of the bucket in the machine's cylinder coordinates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_LENGTH_M


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
