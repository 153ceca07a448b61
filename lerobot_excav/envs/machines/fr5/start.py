"""How a work cell is before the first command."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class WorkcellStart:
    """Places, colours and light of the work cell. Its arrays are read-only.

    Attributes:
        joint_pos: Joint positions of the arm [rad], (6,).
        block_pos_w: Centres of the blocks [m], (4, 3), world frame.
        block_yaw: Turn of the blocks about z [rad], (4,).
        block_rgb: Colours of the blocks, (4, 3), each channel in [0, 1].
        table_rgb: Colour of the table, (3,).
        light_dir_w: Direction of the light, (3,).
        light: Brightness of the light, 0 to 1.
    """

    joint_pos: NDArray[np.float64]
    block_pos_w: NDArray[np.float64]
    block_yaw: NDArray[np.float64]
    block_rgb: NDArray[np.float64]
    table_rgb: NDArray[np.float64]
    light_dir_w: NDArray[np.float64]
    light: float
