"""Forward and inverse kinematics of boom, arm and bucket in the plane of the swing angle."""

from math import acos, atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator import constants as const

_PIN_RADIUS_M = const.BOOM_PIN_S[0]
_PIN_HEIGHT_M = const.SWING_HEIGHT_M + const.BOOM_PIN_S[2]
_LIMIT_TOLERANCE_RAD = 1e-9  # a pose taken from a joint limit must survive the round trip


def forward(joint_pos: ArrayLike) -> tuple[NDArray[np.float64], float]:
    """Return where joint angles (4,) [rad] put the cutting edge.

    Returns:
        Position of the middle of the cutting edge in the world, shape (3,) [m], and the pitch of the bucket
        chord from pin to edge [rad]: counter-clockwise-up, 0 when it points horizontally forward.
    """
    swing, boom, arm, bucket = np.asarray(joint_pos, dtype=np.float64)
    angles = np.cumsum([boom, arm, bucket])
    lengths = (const.BOOM_LENGTH_M, const.ARM_LENGTH_M, const.BUCKET_LENGTH_M)
    radius = _PIN_RADIUS_M + float(np.dot(lengths, np.cos(angles)))
    height = _PIN_HEIGHT_M + float(np.dot(lengths, np.sin(angles)))
    edge = np.array([radius * cos(swing), radius * sin(swing), height]) + const.MACHINE_POS_W
    return edge, float(angles[2])


def inverse(radius_m: float, height_m: float, pitch_rad: float, swing_rad: float) -> NDArray[np.float64] | None:
    """Return the joint angles that hold the cutting edge at a point with a given bucket pitch.

    The elbow is always up: the arm cannot bend the other way.

    Args:
        radius_m: Distance of the edge from the swing axis, in the plane of the swing angle [m].
        height_m: Height of the edge in the world [m].
        pitch_rad: Angle of the chord from bucket pin to edge [rad], as in `forward`; any number of turns.
        swing_rad: Swing angle [rad].

    Returns:
        Swing, boom, arm, bucket [rad], shape (4,), or None where the point is out of reach or a joint would
        leave its range.
    """
    x = radius_m - const.BUCKET_LENGTH_M * cos(pitch_rad) - _PIN_RADIUS_M
    z = height_m - const.BUCKET_LENGTH_M * sin(pitch_rad) - _PIN_HEIGHT_M
    boom_length, arm_length = const.BOOM_LENGTH_M, const.ARM_LENGTH_M
    cos_arm = (x * x + z * z - boom_length**2 - arm_length**2) / (2 * boom_length * arm_length)
    if abs(cos_arm) > 1.0 or hypot(x, z) == 0.0:
        return None
    arm = -acos(cos_arm)
    boom = atan2(z, x) - atan2(arm_length * sin(arm), boom_length + arm_length * cos(arm))
    # A boom pin far behind the wrist makes atan2 jump by a turn; the boom itself never leaves +-pi.
    boom = _wrapped(boom)
    middle = 0.5 * sum(const.JOINT_RANGE_RAD[3])
    bucket = middle + _wrapped(pitch_rad - boom - arm - middle)
    joint_pos = np.array([swing_rad, boom, arm, bucket])
    lower, upper = np.array(const.JOINT_RANGE_RAD).T
    outside = np.maximum(lower - joint_pos, joint_pos - upper)
    return joint_pos if np.all(outside <= _LIMIT_TOLERANCE_RAD) else None


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
