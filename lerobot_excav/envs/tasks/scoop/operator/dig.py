"""How the commanded region is dug: a cut where the soil is thick, a scrape where it is thin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.operator.cut import plan_cut
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose
from lerobot_excav.envs.tasks.scoop.operator.scrape import plan_scrape
from lerobot_excav.envs.tasks.scoop.operator.section import Section
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation
from lerobot_excav.envs.tasks.scoop.targets import Target

THIN_SOIL_M = 0.2
"""Mean height of the soil below which it is scraped [m] (kind: tuned on train scenes): the edge of a cut rises over the
last half metre of soil as thin as this, while the bucket is rolled in."""
LOOK_LENGTH_M = 1.5
"""Over which it is looked at, from the entry towards the machine [m]: about what a cut takes (kind: tuned)."""
MOST_RADIUS_M = 6.1
"""Where the edge enters at the farthest [m]: beyond, only a bucket that points outwards would reach the floor,
and from 6.15 on the way down to bare ground has a jump (kind: derived)."""
END_RADIUS_M = 3.0
"""Where the edge stops at the latest [m]: what it pushes ahead is left where a later cut can begin behind it (kind:
tuned on train scenes)."""
SHORT_WAY_M = 0.9
"""A region so near that less than this way would be left is dug on to `LEAST_RADIUS_M` [m] (kind: tuned there)."""
LEAST_RADIUS_M = 2.3
"""Where the edge stops in any case [m]: nearer, the bucket cannot be rolled in above the floor (kind: derived)."""


@dataclass(frozen=True, kw_only=True)
class Dig:
    """Path of the bucket from above the region until it has loaded."""

    poses: list[BucketPose]
    is_scrape: bool  # whether it follows the floor, where the edge must keep to its path


def end_radius_m(entry_radius_m: ArrayLike) -> NDArray[np.float64]:
    """Return where the edge stops at the latest when it enters at given radii, of any shape [m]."""
    return np.clip(np.asarray(entry_radius_m) - SHORT_WAY_M, LEAST_RADIUS_M, END_RADIUS_M)


def plan_dig(soil: Soil, target: Target, variation: Variation) -> Dig:
    """Plan how to load the bucket from a region, beginning above it, out of the soil."""
    radius, swing, _ = cylinder_from_world(target.center_w)
    entry_radius_m = min(radius + variation.entry_along_m, MOST_RADIUS_M)
    section = Section.of(
        soil,
        swing_rad=swing + variation.entry_across_m / radius,
        entry_radius_m=entry_radius_m,
        end_radius_m=float(end_radius_m(entry_radius_m)),
    )
    if section.thickness_m(LOOK_LENGTH_M) < THIN_SOIL_M:
        return Dig(poses=plan_scrape(section, variation), is_scrape=True)
    return Dig(poses=plan_cut(section, variation), is_scrape=False)
