"""How the commanded region is dug: a cut where the soil is thick, a scrape where it is thin."""

from dataclasses import dataclass

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.operator.cut import plan_cut
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose
from lerobot_excav.envs.tasks.scoop.operator.scrape import plan_scrape
from lerobot_excav.envs.tasks.scoop.operator.section import Section
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation
from lerobot_excav.envs.tasks.scoop.targets import Target

THIN_SOIL_M = 0.13
"""Mean height of the soil below which it is scraped [m] (kind: tuned, after a look at two `val` piles)."""
LOOK_LENGTH_M = 1.5
"""Over which it is looked at, from the entry towards the machine [m]: about what a cut takes (kind: tuned)."""
MOST_RADIUS_M = 6.3
"""Where the edge enters at the farthest [m]: beyond, only a bucket that points outwards would reach the floor
(kind: derived)."""
LEAST_RADIUS_M = 2.5
"""Where the edge stops at the latest, before the dozer blade at 1.9 m [m] (kind: tuned)."""


@dataclass(frozen=True, kw_only=True)
class Dig:
    """Path of the bucket from above the region until it has loaded."""

    poses: list[BucketPose]
    is_scrape: bool  # whether it follows the floor, where the edge must keep to its path


def plan_dig(soil: Soil, target: Target, variation: Variation) -> Dig:
    """Plan how to load the bucket from a region, beginning above it, out of the soil."""
    radius, swing, _ = cylinder_from_world(target.center_w)
    section = Section.of(
        soil,
        swing_rad=swing + variation.entry_across_m / radius,
        entry_radius_m=min(radius + variation.entry_along_m, MOST_RADIUS_M),
        end_radius_m=LEAST_RADIUS_M,
    )
    if section.thickness_m(LOOK_LENGTH_M) < THIN_SOIL_M:
        return Dig(poses=plan_scrape(section, variation), is_scrape=True)
    return Dig(poses=plan_cut(section, variation), is_scrape=False)
