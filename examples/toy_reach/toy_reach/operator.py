"""A scripted operator: straight to the spot, at a pace of its own."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from toy_reach.table import SPEED_M_S


class ReachOperator:
    """Slides to the commanded spot, also when the command changes.

    Args:
        rng: Source of its pace.
    """

    def __init__(self, *, rng: np.random.Generator) -> None:
        self._pace = rng.uniform(0.6, 1.0)

    def reset(self, env: Any) -> None:
        """Look how far it is to the commanded spot; where the spots are it looks up before every action."""
        self._target_id = env.target_id
        way = env.world.spots_w[env.target_id] - env.world.pos_w
        self._approach_s = float(np.abs(way).max()) / (self._pace * SPEED_M_S)

    @property
    def approach_s(self) -> float:
        """How long after the newest command it means to touch what it was told to act on [s]."""
        return self._approach_s

    def act(self, env: Any) -> NDArray[np.float32]:
        """Return the next velocity, (2,)."""
        if env.target_id != self._target_id:
            self.reset(env)
        way = env.world.spots_w[env.target_id] - env.world.pos_w
        return np.asarray(self._pace * np.clip(4.0 * way, -1.0, 1.0), np.float32)
