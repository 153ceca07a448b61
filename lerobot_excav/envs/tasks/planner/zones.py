"""Zones of the ground as a setting writes them."""

import math

from lerobot_excav.errors import require, shown

NO_ZONES = "none"

Zone = tuple[float, float, float, float]
"""A rectangle along the axes of the world: least x, least y, greatest x, greatest y [m]."""


def parsed_zones(field: str, text: str) -> tuple[Zone, ...]:
    """Read zones from a text such as `-0.5,-3,1,-1.5; 2,2,3,3`; `none` has none.

    Raises:
        ConfigurationError: A zone is not four numbers that span an area; the message names the field.
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
    return x_low, y_low, x_high, y_high
