"""Soil presets: bulk properties with the unit, source and kind of every number."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, NamedTuple

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.errors import require, shown


class Origin(NamedTuple):
    """Where a number comes from, and what it may be."""

    unit: str
    low: float  # least allowed value
    high: float  # greatest allowed value
    kind: str  # `paper`, `datasheet`, `derived`, `tuned` or `guess`
    source: str  # document or reasoning


class Strength(NamedTuple):
    """What keeps soil in place, and how much room it takes once it is loose."""

    slope_tan: float  # tangent of the friction angle, which is the repose angle of loose soil
    cohesion_m: float  # cohesion of firm soil over its unit weight [m]
    swell: float  # volume of loosened soil over its volume in the ground


@dataclass(frozen=True, kw_only=True)
class SoilParameters:
    """Bulk properties of one soil; `ORIGINS` has source and range of each."""

    density_kg_m3: float  # bulk density in the ground; loosened soil has this over `swell`
    friction_angle_rad: float  # internal friction; the repose angle is the same number, as in AGX Terrain
    cohesion_pa: float  # cohesion of firm soil: in the digging force, in cuts that stand
    swell: float  # volume of loosened soil over its volume in the ground; it stays loose where it lands
    steel_friction_angle_rad: float  # friction between soil and plate
    parcel_solid_fraction: float = 0.62  # share of a bulk volume that the spheres of its parcels fill
    parcel_sliding_scale: float = 0.62  # sliding friction between parcels over the tangent of the friction angle
    parcel_rolling_scale: float = 0.37  # the same of rolling friction
    ground_sliding_scale: float = 1.7  # sliding friction of parcels on the ground over the same tangent
    ground_rolling_scale: float = 1.3  # the same of rolling friction
    penetration_scale: float = 1.0  # factor on the resistance of the blunt edge

    def __post_init__(self) -> None:
        for name, origin in ORIGINS.items():
            value: Any = getattr(self, name)
            is_number = isinstance(value, Real) and not isinstance(value, bool)
            require(
                is_number and origin.low <= value <= origin.high,
                f"soil {name}={shown(value)} is out of range; allowed: {origin.low} to {origin.high}.",
            )

    @property
    def slope_tan(self) -> float:
        """Tangent of the repose angle."""
        return math.tan(self.friction_angle_rad)

    @property
    def strength(self) -> Strength:
        """Strength of the soil in a height field."""
        cohesion_m = self.cohesion_pa / (self.density_kg_m3 * GRAVITY_M_S2)
        return Strength(self.slope_tan, cohesion_m, self.swell)

    def parcel_mass_kg(self, radius_m: float) -> float:
        """Return the mass of a parcel: its sphere carries the voids around it, so that a heap has the bulk density."""
        sphere_m3 = 4.0 / 3.0 * math.pi * radius_m**3
        return self.density_kg_m3 * sphere_m3 / self.parcel_solid_fraction / self.swell


_AGX = "Algoryx AGX Terrain material presets (AGXUnreal assets, Apache-2.0), values re-typed"

ORIGINS = {
    "density_kg_m3": Origin("kg/m3", 100.0, 5000.0, "paper", _AGX),
    "friction_angle_rad": Origin("rad", 0.05, 1.2, "paper", _AGX),
    "cohesion_pa": Origin("Pa", 0.0, 1e5, "paper", _AGX),
    "swell": Origin("1", 1.0, 2.0, "paper", _AGX),
    "steel_friction_angle_rad": Origin("rad", 0.0, 1.2, "derived", "2/3 of the friction angle, McKyes 1985"),
    "parcel_solid_fraction": Origin("1", 0.3, 1.0, "tuned", "packing of sand that falls into a bucket: filled_bucket"),
    "parcel_sliding_scale": Origin(
        "1", 0.0, 10.0, "guess", "0.5 for sand, usual in DEM; column_collapse hardly depends on it"
    ),
    "parcel_rolling_scale": Origin(
        "1", 0.0, 10.0, "guess", "0.3 for sand, usual in DEM; column_collapse hardly depends on it"
    ),
    "ground_sliding_scale": Origin("1", 0.0, 10.0, "tuned", "experiments column_collapse and heap"),
    "ground_rolling_scale": Origin("1", 0.0, 10.0, "tuned", "experiments column_collapse and heap"),
    "penetration_scale": Origin("1", 0.0, 100.0, "guess", "theory as it is"),
}
"""Source and range of each field of `SoilParameters`."""


def _preset(density: float, friction_deg: float, cohesion: float, swell: float) -> SoilParameters:
    friction = math.radians(friction_deg)
    return SoilParameters(
        density_kg_m3=density,
        friction_angle_rad=friction,
        cohesion_pa=cohesion,
        swell=swell,
        steel_friction_angle_rad=2.0 / 3.0 * friction,
    )


PRESETS = {
    "sand": _preset(1474.0, 39.001, 0.0, 1.0),
    "gravel": _preset(1474.0, 43.997, 0.0, 1.0),
    "dirt": _preset(1474.0, 39.981, 2100.0, 1.1),
    "wet_sand": _preset(1474.0, 33.002, 5000.0, 1.12),
}
"""Known soils by name."""
