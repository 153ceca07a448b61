"""What the machine can reach: the joints that bring the bucket to a wanted pose, or as near to it as they can."""

from math import acos, atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.kinematics import forward, inverse
from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose

Joints = NDArray[np.float64]

_PITCH_STEP_RAD = 0.04
_PITCH_SEARCH_RAD = np.arange(0.0, 1.3, _PITCH_STEP_RAD)
_HALVINGS = 6
_BOOM_PIN_M = const.BOOM_PIN_S[0], const.SWING_HEIGHT_M + const.BOOM_PIN_S[2]
"""Boom pin: radius from the swing axis, height above the floor."""


def bucket_pose(joint_pos: Joints) -> BucketPose:
    """Return where joints (4,) [rad] put the bucket."""
    edge_pos_w, pitch_rad = forward(joint_pos)
    radius, _, height = cylinder_from_world(edge_pos_w)
    return BucketPose(radius_m=radius, height_m=height, pitch_rad=pitch_rad, swing_rad=float(joint_pos[0]))


def joint_pos_near(pose: BucketPose, *, keep: str = "edge") -> Joints:
    """Solve for the joints (4,) [rad]; a pose out of reach gives way in pitch, then in place.

    Args:
        pose: Wanted pose.
        keep: What stays in place as long as a pitch within 1.3 rad allows it: the cutting `edge` or the bucket `pin`.
    """
    if (joint_pos := _joint_pos_turned(pose, 0.0, keep)) is not None:
        return joint_pos
    for outer in _PITCH_SEARCH_RAD[1:]:
        for sign in (1.0, -1.0):
            if (joint_pos := _joint_pos_turned(pose, sign * float(outer), keep)) is not None:
                return _least_turned(pose, joint_pos, sign * float(outer), keep)
    return _joint_pos_towards(pose)


def _least_turned(pose: BucketPose, joint_pos: Joints, turn_rad: float, keep: str) -> Joints:
    """Halve the last step of the search a few times: a path that gives way in steps would jerk."""
    step = 0.5 * float(np.sign(turn_rad)) * _PITCH_STEP_RAD
    for _ in range(_HALVINGS):
        nearer = _joint_pos_turned(pose, turn_rad - step, keep)
        if nearer is not None:
            joint_pos, turn_rad = nearer, turn_rad - step
        step *= 0.5
    return joint_pos


def _joint_pos_turned(pose: BucketPose, turn_rad: float, keep: str) -> Joints | None:
    """Solve for a pose with its pitch changed by an angle [rad], or return None."""
    pitch, radius, height = pose.pitch_rad + turn_rad, pose.radius_m, pose.height_m
    if keep == "pin":
        radius = pose.pin_radius_m + const.BUCKET_LENGTH_M * cos(pitch)
        height = pose.pin_height_m + const.BUCKET_LENGTH_M * sin(pitch)
    return inverse(radius_m=radius, height_m=height, pitch_rad=pitch, swing_rad=pose.swing_rad)


def within_reach(pose: BucketPose, *, keep: str = "edge") -> BucketPose:
    """Return a pose itself, or the nearest one that the machine can reach; see `joint_pos_near`."""
    return bucket_pose(joint_pos_near(pose, keep=keep))


def _joint_pos_towards(pose: BucketPose) -> Joints:
    """Bring the pin towards its place as far as arm and boom go, with the pitch as far as the bucket goes."""
    boom_length, arm_length = const.BOOM_LENGTH_M, const.ARM_LENGTH_M
    _, boom_range, arm_range, bucket_range = const.JOINT_RANGE_RAD
    x, z = pose.pin_radius_m - _BOOM_PIN_M[0], pose.pin_height_m - _BOOM_PIN_M[1]
    cos_arm = (hypot(x, z) ** 2 - boom_length**2 - arm_length**2) / (2.0 * boom_length * arm_length)
    arm = _clipped(-acos(_clipped(cos_arm, (-1.0, 1.0))), arm_range)
    boom = atan2(z, x) - atan2(arm_length * sin(arm), boom_length + arm_length * cos(arm))
    boom = _clipped(_wrapped(boom), boom_range)
    middle = 0.5 * sum(bucket_range)
    bucket = _clipped(middle + _wrapped(pose.pitch_rad - boom - arm - middle), bucket_range)
    return np.array([pose.swing_rad, boom, arm, bucket])


def _clipped(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi
