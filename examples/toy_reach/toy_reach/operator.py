"""A scripted operator: straight to the spot, at a pace of its own."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class ReachOperator:
    """Slides to the commanded spot, also when the command changes.

    Args:
        rng: Source of its pace.
    """

    def __init__(self, *, rng: np.random.Generator) -> None:
        self._pace = rng.uniform(0.6, 1.0)

    def reset(self, env: Any) -> None:
        """Do nothing: it looks at the table before every action."""

    def act(self, env: Any) -> NDArray[np.float32]:
        """Return the next velocity, (2,)."""
        way = env.world.spots_w[env.target_id] - env.world.pos_w
        return np.asarray(self._pace * np.clip(4.0 * way, -1.0, 1.0), np.float32)
