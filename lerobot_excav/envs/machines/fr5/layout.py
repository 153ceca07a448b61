"""Where things are in the work cell; world frame, z up, the table top at z = 0 [m].

Positions follow the published scene of the same task where they say so.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import CameraPose

BASE_POS_W = (0.5, 0.5, 0.0)
"""Foot of the arm, not turned: it works towards -x (kind: paper)."""

BLOCK_COUNT = 4
NO_BLOCK = -1
"""What stands for none of the blocks where an index is expected."""
BLOCK_SIZE_M = 0.04  # edge (kind: paper)
BLOCK_REST_M = 0.5 * BLOCK_SIZE_M  # height of its centre on the table
BLOCK_MASS_KG = 0.05  # kind: paper
BLOCK_FRICTION = (1.0, 0.005, 0.0001)  # painted wood on a table top (kind: guess)

BLOCK_AREA_X_W = (0.0, 0.2)
BLOCK_AREA_Y_W = (0.4, 0.6)
"""Where the centres of the blocks may lie: the published area of targets, as every block may be one (kind: paper)."""
BLOCK_SPACING_M = 0.08
"""Least distance of two centres [m]; the published 0.07 leaves the open fingers 0.8 mm on either side (kind: tuned)."""
BLOCK_YAW_RAD = 0.1  # largest turn of a block about z (kind: guess)

TRAY_POS_W = (0.42, 0.75)
TRAY_RADIUS_M, TRAY_HEIGHT_M = 0.08, 0.02  # kind: paper
TRAY_RIM_M = 0.012  # height of the rim above the tray's floor (kind: guess)


# The published cameras stand here, for pictures of 480 x 640; at 96 x 128 a block would be four pixels wide. Both look
# closer, at blocks and tray (positions: paper; directions and fields of view: tuned).
CAMERAS = {
    "main": CameraPose((0.62, 0.60, 0.62), (0.14, 0.54, 0.0), 48.0),
    "top": CameraPose((0.0, 0.6, 0.8), (0.16, 0.575, 0.0), 40.0),
    "overview": CameraPose((-0.90, -0.25, 0.75), (0.28, 0.53, 0.22), 38.0),
}


def over_tray(pos_w: NDArray[np.float64]) -> bool:
    """Return whether a point is above the tray's floor, position (3,) [m]."""
    return bool(np.hypot(pos_w[0] - TRAY_POS_W[0], pos_w[1] - TRAY_POS_W[1]) < TRAY_RADIUS_M)
