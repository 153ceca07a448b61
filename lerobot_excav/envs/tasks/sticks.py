"""Two sticks, four axes: how a person drives a machine by hand.

x is positive to the right and y positive towards the operator, as SDL and browsers report them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

AXES = ("left_x", "left_y", "right_x", "right_y")

PATTERN_NAMES = ("iso", "sae")
"""Control patterns: which hand does what."""


@dataclass(frozen=True, kw_only=True)
class StickResponse:
    """How sticks answer.

    Attributes:
        pattern: One of `PATTERN_NAMES`.
        dead_zone: Deflection without effect, in [0, 1); the rest is rescaled, so control starts without a step.
        expo: 0 for a straight response, 1 for the finest control near the centre.
        invert: Axes that are turned around.
    """

    pattern: str = "iso"
    dead_zone: float = 0.08
    expo: float = 0.0
    invert: tuple[str, ...] = ()

    def of(self, axes: Mapping[str, float], axis: str) -> float:
        """Return what an axis asks for, in [-1, 1]."""
        value = respond(axes[axis], dead_zone=self.dead_zone, expo=self.expo)
        return -value if axis in self.invert else value


Legend = Mapping[str, Mapping[str, tuple[str, str]]]
"""By pattern and axis: what the axis does when it is negative, and when it is positive, in a word or two."""


class StickControl(Protocol):
    """What the sticks mean to a machine; a task names its own as `TaskSpec.sticks_entry`."""

    legend: Legend

    def reset(self, env: Any) -> None:
        """Begin to drive an environment of the task from its present state."""

    def action(self, axes: Mapping[str, float], response: StickResponse) -> NDArray[np.float32]:
        """Return the action (actions,) that axes in [-1, 1] ask for; sticks at rest hold the machine still."""


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
