"""Where a machine has acted in an episode, for comparison with where it was told to."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class ActedPlace:
    """What a machine has done to the world, as a place of the ground plane, world frame.

    Attributes:
        began_w: Where the tool was when acting began (2,) [m].
        acted_w: Where the world was changed (2,) [m].
        share: Which part of the change lies where it was commanded, 0 to 1.
    """

    began_w: NDArray[np.float64]
    acted_w: NDArray[np.float64]
    share: float


class PlaceProbe(Protocol):
    """Follows an environment of a task through an episode; made with `env` after every `reset`."""

    def __init__(self, env: Any) -> None:
        """Look at a freshly reset environment."""

    def update(self) -> None:
        """Take in the frame that has just passed."""

    @property
    def tool_pos_w(self) -> NDArray[np.float64]:
        """Where the tool is now (3,) [m], world frame."""

    @property
    def commanded_w(self) -> NDArray[np.float64]:
        """Middle of what is commanded now, on the ground plane (2,) [m], world frame."""

    @property
    def has_begun(self) -> bool:
        """Whether acting has begun."""

    def acted(self) -> ActedPlace | None:
        """Return where the machine has acted so far; None if nowhere."""
