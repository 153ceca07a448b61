"""Where the disc has come to rest: what `lerobot-excav audit` asks a task for."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.acted_place import ActedPlace
from toy_reach.env import ReachEnv
from toy_reach.table import SPOT_RADIUS_M

SLOW_M = 0.04
"""Way per frame below which the disc counts as arrived [m]."""


class ArrivedPlace:
    """Follows one episode: the disc acts where it arrives.

    Args:
        env: The environment, freshly reset.
    """

    def __init__(self, env: ReachEnv) -> None:
        self._env = env
        self._last_w = env.world.pos_w.copy()
        self._has_moved = False
        self._began_w: NDArray[np.float64] | None = None

    def update(self) -> None:
        """Take in the frame that has just passed."""
        way_m = float(np.linalg.norm(self._env.world.pos_w - self._last_w))
        self._last_w = self._env.world.pos_w.copy()
        self._has_moved |= way_m >= SLOW_M
        if self._began_w is None and self._has_moved and way_m < SLOW_M:
            self._began_w = self._last_w

    @property
    def tool_pos_w(self) -> NDArray[np.float64]:
        """Middle of the disc (3,) [m]."""
        return np.append(self._env.world.pos_w, 0.0)

    @property
    def commanded_w(self) -> NDArray[np.float64]:
        """Middle of the commanded spot (2,) [m]."""
        return np.array(self._env.world.spots_w[self._env.target_id])

    @property
    def has_begun(self) -> bool:
        """Whether the disc has arrived somewhere."""
        return self._began_w is not None

    def acted(self) -> ActedPlace | None:
        """Return where the disc is, if it has arrived somewhere."""
        if self._began_w is None:
            return None
        place_w = self._env.world.pos_w.copy()
        is_there = np.linalg.norm(place_w - self.commanded_w) < SPOT_RADIUS_M
        return ActedPlace(began_w=self._began_w, acted_w=place_w, share=float(is_there))
