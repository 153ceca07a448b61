"""The task as a gymnasium environment."""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.selection import Selection
from lerobot_excav.errors import require
from toy_reach.spec import ReachSettings
from toy_reach.table import SPOT_RADIUS_M, Table, TableRenderer, draw_spots

FRAMES_ON_TARGET = 3
"""How long the disc has to stay on the spot."""


class ReachEnv(MaskedTaskEnv[Table, TableRenderer]):
    """A disc that slides over a table; success: it stays on the commanded spot for three frames."""

    TASK = "Reach-v0"

    def _make_world(self) -> Table:
        return Table(cast(ReachSettings, self.settings).table)

    def _make_renderer(self, world: Table, height: int, width: int) -> TableRenderer:
        return TableRenderer(world, height=height, width=width)

    def _make_view(self, height: int, width: int) -> TableRenderer:
        return TableRenderer(self.world, height=height, width=width)

    def _start(self, selection: Selection) -> None:
        self.world.reset(draw_spots(self.settings.scene_set, selection.scene_id))
        self._target, self._on_target = selection.target_id, 0

    def _advance(self, action: NDArray[Any]) -> tuple[float, bool]:
        action = np.asarray(action, np.float64)
        require(
            action.shape == (2,) and bool(np.isfinite(action).all()),
            f"action={action!r} is not possible; give two finite numbers in [-1, 1]",
        )
        for _ in range(self._ticks_per_frame):
            self.world.tick(action)
        self._on_target = self._on_target + 1 if self._distance_m() < SPOT_RADIUS_M else 0
        return float(self._on_target > 0), self.is_success

    def holding_action(self) -> NDArray[np.float32]:
        """Return the action that holds the machine still."""
        return np.zeros(2, np.float32)

    def _region(self, target_id: int) -> int:
        return target_id

    def _begin_command(self, target_id: int) -> None:
        self._target, self._on_target = target_id, 0

    def true_mask(self, command: Command) -> Pixels:
        """Return the pixels of the spot."""
        return self.renderer.spot_pixels(command.region)

    @property
    def agent_pos(self) -> NDArray[np.float32]:
        """Place of the disc [m], (2,)."""
        return self.world.pos_w.astype(np.float32)

    @property
    def task_state(self) -> NDArray[np.float32]:
        """Distance to the spot [m] and frames on it, (2,)."""
        return np.array([self._distance_m(), self._on_target], np.float32)

    @property
    def is_success(self) -> bool:
        """Whether the disc has stayed on the spot."""
        return self._on_target >= FRAMES_ON_TARGET

    def _measures(self) -> dict[str, Any]:
        return {"final_distance_m": self._distance_m()}

    def _distance_m(self) -> float:
        return float(np.linalg.norm(self.world.pos_w - self.world.spots_w[self._target]))
