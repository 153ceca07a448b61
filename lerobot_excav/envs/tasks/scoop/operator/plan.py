"""Planning of one cycle's bucket paths from the target and the terrain."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, cylinder_from_world, world_from_cylinder
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose, line
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation
from lerobot_excav.envs.tasks.scoop.targets import Target

# Numbers of the plan (kind: tuned on train scenes).
HOVER_HEIGHT_M = 0.45
FLOOR_CLEARANCE_M = 0.06
ENTRY_LENGTH_M = 0.35
"""Length over which the edge goes down to the full depth of cut [m]."""
CUT_STEP_M = 0.05
LEAST_RADIUS_M = 2.5
CURL_DRAW_M = 0.5
"""How far the bucket is drawn towards the machine while it is rolled in [m]."""
CURL_RISE_M = 0.3
CARRY_PITCH_RAD = -3.0
LIFT_PIN_HEIGHT_M = 1.9
DUMP_PITCH_RAD = -0.75
DUMP_PIN_OFFSET_M = -0.2
"""Where the pin hovers, from the middle of the box [m]: the soil leaves when the edge has swung out beyond it."""
DUMP_REACH_M = 0.1
"""How far the pin moves outwards while the bucket opens [m]."""


def plan_cut(soil: Soil, target: Target, variation: Variation) -> list[BucketPose]:
    """Plan the cut: down into the patch, then towards the machine until the bucket has swept its fill.

    It begins above the entry, out of the soil.
    """
    radius, swing, _ = cylinder_from_world(target.center_w)
    entry_radius = radius + variation.entry_along_m
    swing += variation.entry_across_m / radius
    radii = np.arange(entry_radius, LEAST_RADIUS_M, -CUT_STEP_M, dtype=np.float64)
    surface = soil.height_at(world_from_cylinder(radii, np.full_like(radii, swing)))
    heights = _cut_heights(radii, surface, variation.depth_m, variation.cut_volume_m3)
    pitches = np.linspace(variation.attack_pitch_rad, variation.roll_in_pitch_rad, heights.size)
    cut = [
        BucketPose(radius_m=float(r), height_m=float(z), pitch_rad=float(p), swing_rad=swing)
        for r, z, p in zip(radii, heights, pitches, strict=False)
    ]
    above = BucketPose(
        radius_m=entry_radius + 0.1,
        height_m=float(surface[0]) + HOVER_HEIGHT_M,
        pitch_rad=variation.attack_pitch_rad,
        swing_rad=swing,
    )
    return [*line(above, cut[0], about_pin=False, samples=8), *cut[1:]]


def plan_curl(present: BucketPose) -> list[BucketPose]:
    """Plan the curl: close the bucket where it is, while drawing it up out of the soil."""
    curled = BucketPose.of_pin(
        radius_m=max(present.pin_radius_m - CURL_DRAW_M, LEAST_RADIUS_M),
        height_m=max(present.pin_height_m + CURL_RISE_M, 0.9),
        pitch_rad=CARRY_PITCH_RAD,
        swing_rad=present.swing_rad,
    )
    return line(present, curled, about_pin=True)


def plan_lift(present: BucketPose) -> list[BucketPose]:
    """Plan the lift: straight up, until the swing to the box may begin."""
    lifted = BucketPose.of_pin(
        radius_m=present.pin_radius_m,
        height_m=max(present.pin_height_m, LIFT_PIN_HEIGHT_M),
        pitch_rad=CARRY_PITCH_RAD,
        swing_rad=present.swing_rad,
    )
    return line(present, lifted, about_pin=True)


def plan_carry(present: BucketPose, variation: Variation) -> list[BucketPose]:
    """Plan the carry: over the wall of the box with the load level."""
    return line(present, _over_box(variation), about_pin=True, samples=40)


def plan_dump(present: BucketPose, variation: Variation) -> list[BucketPose]:
    """Plan the dump: open the bucket while reaching out, so that the load falls on the middle of the box."""
    over_box = _over_box(variation)
    opened = BucketPose.of_pin(
        radius_m=over_box.pin_radius_m + DUMP_REACH_M,
        height_m=over_box.pin_height_m + 0.2,
        pitch_rad=DUMP_PITCH_RAD,
        swing_rad=over_box.swing_rad,
    )
    return line(present, opened, about_pin=True)


def _over_box(variation: Variation) -> BucketPose:
    radius, swing, _ = cylinder_from_world(np.asarray(TARGET_BOX.center_w))
    return BucketPose.of_pin(
        radius_m=radius + DUMP_PIN_OFFSET_M + variation.dump_along_m,
        height_m=TARGET_BOX.wall_height_m + variation.carry_height_m,
        pitch_rad=CARRY_PITCH_RAD,
        swing_rad=swing,
    )


def _cut_heights(
    radii: NDArray[np.float64], surface_m: NDArray[np.float64], depth_m: float, volume_m3: float
) -> NDArray[np.float64]:
    """Height of the edge along the cut [m], as long as it takes to sweep the wanted volume.

    Where the pile is too small for the wanted depth of cut, cut deeper rather than bring half a bucket.
    """
    ramp = np.minimum((radii[0] - radii) / ENTRY_LENGTH_M, 1.0)
    for extra_m in np.arange(0.0, 0.45, 0.05):
        heights = np.maximum(surface_m - (depth_m + extra_m) * ramp, FLOOR_CLEARANCE_M)
        heights = np.minimum(heights, surface_m + FLOOR_CLEARANCE_M)
        swept_m3 = np.cumsum(np.maximum(surface_m - heights, 0.0)) * CUT_STEP_M * BUCKET_INNER_WIDTH_M
        enough = np.nonzero(swept_m3 >= volume_m3)[0]
        if enough.size:
            return np.asarray(heights[: max(int(enough[0]) + 1, 3)])
    # The whole pile along this line is less than a bucket: stop where it ends.
    last = int(np.argmax(swept_m3 >= swept_m3[-1] - 1e-9))
    return np.asarray(heights[: max(last + 1, 3)])
