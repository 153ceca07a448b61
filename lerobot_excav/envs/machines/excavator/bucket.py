"""The bucket: its inner cross-section and the volumes that the standards define for it."""

import numpy as np

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.soil.tool import ToolGeometry


def bucket_geometry() -> ToolGeometry:
    """Return the bucket as the soil sees it: profile in the tool frame and inner width."""
    return ToolGeometry(profile_t=np.array(const.BUCKET_PROFILE_T), inner_width_m=const.BUCKET_INNER_WIDTH_M)


def heaped_volume_m3(geometry: ToolGeometry) -> float:
    """Return the SAE J296 heaped volume [m3]: struck volume plus a 1:1 hip roof over the opening.

    The opening is a rectangle of length L (edge to back lip) and width W < L. A roof that rises 1:1 from all
    four sides has its ridge W/2 above the opening and the volume W^2 L / 4 - W^3 / 12.
    """
    length = float(np.linalg.norm(geometry.profile_t[0] - geometry.profile_t[-1]))
    width = geometry.inner_width_m
    return geometry.struck_volume_m3 + width**2 * length / 4 - width**3 / 12
