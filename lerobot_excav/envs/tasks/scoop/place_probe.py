"""Where an excavator has dug in an episode."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.acted_place import ActedPlace
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.missing_soil import missing_soil

MARGIN_M = 0.2
"""Soil from so far around a patch counts as the patch's: what a cut loosens slides [m] (kind: design)."""


class DugPlace:
    """Follows one scoop: acting begins with loading, and the change is the soil that is missing.

    Args:
        env: The environment, freshly reset.
    """

    def __init__(self, env: ExcavatorEnv) -> None:
        self._env = env
        self._heights_m = env.worksite.soil.heights_m.copy()
        self._began_w: NDArray[np.float64] | None = None

    def update(self) -> None:
        """Take in the frame that has just passed."""
        if self._began_w is None and self._env.cycle.onset_w is not None:
            self._began_w = self._env.cycle.onset_w[:2].copy()

    @property
    def tool_pos_w(self) -> NDArray[np.float64]:
        """Middle of the cutting edge (3,) [m], world frame."""
        return np.array(self._env.worksite.machine.cutting_edge_pos_w)

    @property
    def commanded_w(self) -> NDArray[np.float64]:
        """Middle of the commanded patch (2,) [m], world frame."""
        return self._env.target.center_w[:2].copy()

    @property
    def has_begun(self) -> bool:
        """Whether the bucket has begun to load."""
        return self._began_w is not None

    def acted(self) -> ActedPlace | None:
        """Return where soil is missing, weighted with the missing height; None if nothing was loaded."""
        soil = self._env.worksite.soil
        source_w, _ = missing_soil(self._heights_m, soil.heights_m, soil.x_w, soil.y_w)
        if self._began_w is None or source_w is None:
            return None
        missing_m = np.maximum(self._heights_m - soil.heights_m, 0.0)
        cells_w = np.stack(np.meshgrid(soil.x_w, soil.y_w, indexing="ij"), axis=-1)
        inside = self._env.target.grown(MARGIN_M).contains(cells_w)
        share = float(missing_m[inside].sum() / missing_m.sum())
        return ActedPlace(began_w=self._began_w, acted_w=np.array(source_w), share=share)
