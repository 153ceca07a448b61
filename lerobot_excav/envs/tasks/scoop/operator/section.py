"""The soil along a straight way of the bucket towards the machine."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M
from lerobot_excav.envs.machines.excavator.layout import world_from_cylinder
from lerobot_excav.envs.soil import Soil

STEP_M = 0.05
_ACROSS_M = BUCKET_INNER_WIDTH_M * np.array([-0.375, -0.125, 0.125, 0.375])


@dataclass(frozen=True, kw_only=True)
class Section:
    """Heights of the soil from an entry towards the machine, every `STEP_M`."""

    radii_m: NDArray[np.float64]  # (n,) from the swing axis, falling
    surface_m: NDArray[np.float64]  # (n,) above the floor, in the middle of the bucket
    mean_m: NDArray[np.float64]  # (n,) above the floor, mean over the width of the bucket
    swing_rad: float

    @classmethod
    def of(cls, soil: Soil, *, swing_rad: float, entry_radius_m: float, end_radius_m: float) -> "Section":
        """Look at the soil at a swing angle between two radii."""
        radii = np.arange(entry_radius_m, end_radius_m, -STEP_M, dtype=np.float64)
        points_w = world_from_cylinder(radii[:, None], swing_rad + _ACROSS_M / radii[:, None])
        return cls(
            radii_m=radii,
            surface_m=soil.height_at(world_from_cylinder(radii, swing_rad)),
            mean_m=soil.height_at(points_w).mean(axis=1),
            swing_rad=swing_rad,
        )

    def thickness_m(self, length_m: float) -> float:
        """Return the mean height of the soil over the first part of the way [m]."""
        return float(self.mean_m[: round(length_m / STEP_M)].mean())
