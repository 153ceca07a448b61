"""How a work cell looks: what may differ between pictures without changing the task."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class WorkcellLook:
    """Colours and light of the work cell.

    Attributes:
        block_rgb: Colours of the blocks, (4, 3), each channel in [0, 1].
        table_rgb: Colour of the table, (3,).
        light_dir_w: Direction of the light, (3,).
        light: Brightness of the light, 0 to 1.
    """

    block_rgb: NDArray[np.float64]
    table_rgb: NDArray[np.float64]
    light_dir_w: NDArray[np.float64]
    light: float
