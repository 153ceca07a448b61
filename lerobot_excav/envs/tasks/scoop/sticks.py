"""The excavator's sticks: each of the four axes drives one joint, as on a real machine."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.sticks import StickResponse

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

_MOTIONS = {
    "swing": ("swing right", "swing left"),
    "boom": ("boom down", "boom up"),
    "arm": ("arm in", "arm out"),
    "bucket": ("curl", "dump"),
}
"""What a negative and a positive command of a joint does."""


class DigSticks:
    """Drives the excavator; it needs no memory."""

    legend = {  # noqa: RUF012 - constant
        pattern: {
            axis: (_MOTIONS[joint] if sign > 0.0 else _MOTIONS[joint][::-1]) for joint, (axis, sign) in axes.items()
        }
        for pattern, axes in PATTERNS.items()
    }

    def reset(self, env: Any) -> None:
        """Do nothing: a rate command does not depend on where the machine is."""

    def action(self, axes: Mapping[str, float], response: StickResponse) -> NDArray[np.float32]:
        """Return the rate commands (4,) in [-1, 1] of swing, boom, arm and bucket."""
        return np.array(list(joint_commands(axes, response).values()), np.float32)


def joint_commands(axes: Mapping[str, float], response: StickResponse) -> dict[str, float]:
    """Return the command of each joint in [-1, 1], in the order swing, boom, arm, bucket."""
    return {
        joint: sign * response.of(axes, axis) + 0.0  # no negative zero
        for joint, (axis, sign) in PATTERNS[response.pattern].items()
    }
