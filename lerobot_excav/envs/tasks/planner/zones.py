"""Zones of the ground as a setting writes them."""

import math
from collections.abc import Sequence

from lerobot_excav.envs.machines.excavator.constants import DIG_AREA_EXTENT_M
from lerobot_excav.errors import require, shown

NO_ZONES = "none"

Zone = tuple[float, float, float, float]
"""A rectangle along the axes of the world: least x, least y, greatest x, greatest y [m]."""


def parsed_zones(field: str, text: str) -> tuple[Zone, ...]:
    """Read zones from a text such as `-0.5,-3,1,-1.5; 2,2,3,3`; `none` has none.

    Raises:
        ConfigurationError: A zone is not four numbers that span an area, or lies beside the dig area; the message names
            the field.
    """
    if text.strip() == NO_ZONES:
        return ()
    return tuple(_zone(f"{field}={shown(text)}", part) for part in text.split(";"))


def _zone(place: str, part: str) -> Zone:
    try:
        x_low, y_low, x_high, y_high = (float(word) for word in part.split(","))
        is_zone = -math.inf < x_low < x_high < math.inf and -math.inf < y_low < y_high < math.inf
    except ValueError:
        is_zone = False
    require(
        is_zone,
        f"{place}: {shown(part.strip())} is not a zone; give the least x and y and the greatest x and y of a rectangle "
        f"[m], such as -0.5,-3,1,-1.5, or {NO_ZONES}",
    )
    half_x, half_y = 0.5 * DIG_AREA_EXTENT_M[0], 0.5 * DIG_AREA_EXTENT_M[1]
    require(
        x_low < half_x and x_high > -half_x and y_low < half_y and y_high > -half_y,
        f"{place}: {shown(part.strip())} lies beside the dig area and bars nothing; x reaches from {-half_x:g} to "
        f"{half_x:g} m, y from {-half_y:g} to {half_y:g} m",
    )
    return x_low, y_low, x_high, y_high


def zone_text(zones: Sequence[Zone]) -> str:
    """Write zones as a setting, in the one spelling that files compare."""
    texts = (",".join(f"{edge + 0.0:.10g}" for edge in zone) for zone in zones)  # + 0.0: no -0
    return "; ".join(sorted(set(texts))) or NO_ZONES
