"""The bucket: its inner cross-section and the volumes that the standards define for it."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.excavator import constants as const
from lerobot_excav.envs.soil.tool import ToolGeometry


def bucket_geometry() -> ToolGeometry:
    """Return the bucket as the soil sees it: profile in the tool frame and inner width."""
    return ToolGeometry(profile_t=np.array(const.BUCKET_PROFILE_T), inner_width_m=const.BUCKET_INNER_WIDTH_M)


def cross_section_m2(profile_t: NDArray[np.float64]) -> float:
    """Return the area between a profile and its opening line (shoelace formula).

    Args:
        profile_t: Polyline (n, 2) of (x, z) from the cutting edge to the back lip [m].
    """
    x, z = np.asarray(profile_t).T
    return float(0.5 * abs(x @ np.roll(z, -1) - z @ np.roll(x, -1)))


def struck_volume_m3(geometry: ToolGeometry) -> float:
    """Return the volume of a bucket filled level with its opening [m3]."""
    return cross_section_m2(geometry.profile_t) * geometry.inner_width_m


def heaped_volume_m3(geometry: ToolGeometry) -> float:
    """Return the SAE J296 heaped volume [m3]: struck volume plus a 1:1 hip roof over the opening.

    The opening is a rectangle of length L (edge to back lip) and width W < L. A roof that rises 1:1 from all
    four sides has its ridge W/2 above the opening and the volume W^2 L / 4 - W^3 / 12.
    """
    length = float(np.linalg.norm(geometry.profile_t[0] - geometry.profile_t[-1]))
    width = geometry.inner_width_m
    return struck_volume_m3(geometry) + width**2 * length / 4 - width**3 / 12
