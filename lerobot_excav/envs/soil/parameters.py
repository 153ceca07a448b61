"""Soil presets: bulk properties with the unit, source and kind of every number."""

import math
from dataclasses import dataclass

from lerobot_excav.errors import require


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Where a number comes from: its unit, its source and its kind (paper, datasheet, derived, tuned, guess)."""

    unit: str
    source: str
    kind: str


@dataclass(frozen=True, kw_only=True)
class SoilParameters:
    """Bulk properties of one soil; `ORIGINS` has the source of each.

    Attributes:
        density_kg_m3: Bulk density, on the ground as in the air.
        friction_angle_rad: Internal friction; the repose angle is the same number, as in AGX Terrain.
        cohesion_pa: Cohesion, in the digging force and between parcels.
        swell: Volume of loosened soil in the bucket over its volume in the ground.
        steel_friction_angle_rad: Friction between soil and plate.
        parcel_solid_fraction: Share of a bulk volume that the spheres of its parcels fill.
        parcel_sliding_scale: Sliding friction between parcels over the tangent of the friction angle.
        parcel_rolling_scale: The same of rolling friction.
        ground_sliding_scale: Sliding friction of parcels on the ground over the tangent of the friction angle.
        ground_rolling_scale: The same of rolling friction.
        penetration_scale: Factor on the bearing resistance of the cutting edge.
    """

    density_kg_m3: float
    friction_angle_rad: float
    cohesion_pa: float
    swell: float
    steel_friction_angle_rad: float
    parcel_solid_fraction: float = 0.56
    parcel_sliding_scale: float = 0.62
    parcel_rolling_scale: float = 0.37
    ground_sliding_scale: float = 1.7
    ground_rolling_scale: float = 1.3
    penetration_scale: float = 1.0

    def __post_init__(self) -> None:
        for name, low, high in _ALLOWED:
            value = getattr(self, name)
            require(
                math.isfinite(value) and low <= value <= high,
                f"soil {name}={value!r} is out of range; allowed: {low} to {high}.",
            )

    @property
    def slope_tan(self) -> float:
        """Tangent of the repose angle."""
        return math.tan(self.friction_angle_rad)

    def parcel_mass_kg(self, radius_m: float) -> float:
        """Return the mass of a parcel: its sphere carries the voids around it, so that a heap has the bulk density."""
        sphere_m3 = 4.0 / 3.0 * math.pi * radius_m**3
        return self.density_kg_m3 * sphere_m3 / self.parcel_solid_fraction / self.swell


_ALLOWED = (
    ("density_kg_m3", 100.0, 5000.0),
    ("friction_angle_rad", 0.05, 1.2),
    ("cohesion_pa", 0.0, 1e5),
    ("swell", 1.0, 2.0),
    ("steel_friction_angle_rad", 0.0, 1.2),
    ("parcel_solid_fraction", 0.3, 1.0),
    ("parcel_sliding_scale", 0.0, 10.0),
    ("parcel_rolling_scale", 0.0, 10.0),
    ("ground_sliding_scale", 0.0, 10.0),
    ("ground_rolling_scale", 0.0, 10.0),
    ("penetration_scale", 0.0, 100.0),
)

_AGX = "Algoryx AGX Terrain material presets (AGXUnreal assets, Apache-2.0), values re-typed"

ORIGINS = {
    "density_kg_m3": Origin(unit="kg/m3", source=_AGX, kind="paper"),
    "friction_angle_rad": Origin(unit="rad", source=_AGX, kind="paper"),
    "cohesion_pa": Origin(unit="Pa", source=_AGX, kind="paper"),
    "swell": Origin(unit="1", source=_AGX, kind="paper"),
    "steel_friction_angle_rad": Origin(
        unit="rad", source="2/3 of the friction angle, McKyes 1985", kind="derived"
    ),
    "parcel_solid_fraction": Origin(
        unit="1", source="parcels poured gently into a bucket pack to 0.56", kind="tuned"
    ),
    "parcel_sliding_scale": Origin(
        unit="1", source="0.5 for sand, usual in DEM; T1 hardly depends on it", kind="guess"
    ),
    "parcel_rolling_scale": Origin(
        unit="1", source="0.3 for sand, usual in DEM; T1 hardly depends on it", kind="guess"
    ),
    "ground_sliding_scale": Origin(unit="1", source="column collapse and heap (T1, T3)", kind="tuned"),
    "ground_rolling_scale": Origin(unit="1", source="column collapse and heap (T1, T3)", kind="tuned"),
    "penetration_scale": Origin(unit="1", source="bearing theory as it is", kind="guess"),
}
"""Source of each field of `SoilParameters`."""


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
