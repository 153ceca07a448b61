"""What pictures of the worksite show, as numbers: for reinforcement learning without pictures."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.scoop.spec import HEIGHT_CELLS
from lerobot_excav.envs.tasks.scoop.targets import Target

_KG_PER_T = 1000.0


def environment_state(worksite: Worksite, target: Target) -> NDArray[np.float32]:
    """Return the elements that `spec.ENVIRONMENT_STATE_NAMES` names, (n,) float32."""
    soil, yaw = worksite.soil, target.yaw_rad
    masses_t = np.array([soil.payload_mass_kg, soil.box_mass_kg]) / _KG_PER_T
    coarse_m = coarse_heights_m(soil.heights_m)
    return np.concatenate([target.center_w, [np.sin(yaw), np.cos(yaw)], masses_t, coarse_m.ravel()]).astype(np.float32)


def coarse_heights_m(heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean heights of blocks of cells (12, 12) [m] of the dig area's heights (nx, ny)."""
    (nx, ny), (cells_x, cells_y) = heights_m.shape, HEIGHT_CELLS
    blocks = heights_m.reshape(cells_x, nx // cells_x, cells_y, ny // cells_y)
    return np.asarray(blocks.mean(axis=(1, 3)))
