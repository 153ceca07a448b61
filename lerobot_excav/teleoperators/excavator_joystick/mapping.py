"""From sticks to joystick commands: control pattern, dead-zone and response. Pure functions of numbers.

Stick axes are named `left_x`, `left_y`, `right_x`, `right_y`; x is positive to the right and y positive
towards the operator, as SDL reports them.
"""

import math
from collections.abc import Collection, Mapping

AXES = ("left_x", "left_y", "right_x", "right_y")

PATTERNS: Mapping[str, Mapping[str, tuple[str, float]]] = {
    # ISO 10968: left hand swing and arm, right hand boom and bucket.
    "iso": {
        "swing": ("left_x", -1.0),  # lever left: swing left, which is positive
        "boom": ("right_y", 1.0),  # lever back: boom up
        "arm": ("left_y", -1.0),  # lever forward: arm out
        "bucket": ("right_x", 1.0),  # lever left: curl, which is negative
    },
    # SAE J1814 ("backhoe"): boom and arm change hands.
    "sae": {"swing": ("left_x", -1.0), "boom": ("left_y", 1.0), "arm": ("right_y", -1.0), "bucket": ("right_x", 1.0)},
}
"""For each joint of a control pattern, the axis that drives it and the axis' sign."""


def respond(value: float, *, dead_zone: float, expo: float = 0.0) -> float:
    """Shape one axis: still within the dead-zone, then rising without a step to full deflection.

    The travel outside the dead-zone is rescaled to [0, 1] and bent: u -> (1 - expo) u + expo u^3.

    Args:
        value: Deflection; beyond [-1, 1] it is clipped.
        dead_zone: Deflection below which the answer is 0, in [0, 1).
        expo: 0 for a straight response, 1 for the finest control near the centre.

    Returns:
        Command in [-1, 1] of the same sign.
    """
    travel = max(min(abs(value), 1.0) - dead_zone, 0.0) / (1.0 - dead_zone)
    return math.copysign((1.0 - expo) * travel + expo * travel**3, value)


def joint_commands(
    axes: Mapping[str, float], *, pattern: str, dead_zone: float, expo: float, invert: Collection[str]
) -> dict[str, float]:
    """Return the command of each joint in [-1, 1], in the order swing, boom, arm, bucket.

    Args:
        axes: Position of each axis of `AXES` in [-1, 1].
        pattern: Name of a control pattern, `iso` or `sae`.
        dead_zone: See `respond`.
        expo: See `respond`.
        invert: Axes whose sign is turned around.
    """
    commands = {}
    for joint, (axis, sign) in PATTERNS[pattern].items():
        value = sign * respond(axes[axis], dead_zone=dead_zone, expo=expo)
        commands[joint] = (-value if axis in invert else value) + 0.0  # no negative zero
    return commands
