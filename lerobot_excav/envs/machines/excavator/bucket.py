"""The bucket as the soil sees it."""

import numpy as np

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.soil.tool import ToolGeometry


def bucket_geometry() -> ToolGeometry:
    """Return its profile in the tool frame and its inner width."""
    return ToolGeometry(profile_t=np.array(const.BUCKET_PROFILE_T), inner_width_m=const.BUCKET_INNER_WIDTH_M)
