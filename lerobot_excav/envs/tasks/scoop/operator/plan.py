"""Planning of the bucket's paths after the cut: curl, lift, carry and dump."""

import numpy as np

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, cylinder_from_world
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose, line
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation

# Numbers of the plan (kind: tuned on train scenes).
CURL_DRAW_M = 0.5
"""How far the bucket is drawn towards the machine while it is rolled in [m]."""
LEAST_PIN_RADIUS_M = 3.1
"""How near the swing axis the pin is drawn [m]: the arm folds no further than 3.0 m (kind: derived)."""
CURL_RISE_M = 0.3
CARRY_PITCH_RAD = -3.0
LIFT_PIN_HEIGHT_M = 1.9
DUMP_PITCH_RAD = -0.75
DUMP_PIN_OFFSET_M = -0.2
"""Where the pin hovers, from the middle of the box [m]: the soil leaves when the edge has swung out beyond it."""
DUMP_REACH_M = 0.1
"""How far the pin moves outwards while the bucket opens [m]."""


def plan_curl(present: BucketPose) -> list[BucketPose]:
    """Plan the curl: close the bucket where it is, while drawing it up out of the soil."""
    curled = BucketPose.of_pin(
        radius_m=max(present.pin_radius_m - CURL_DRAW_M, LEAST_PIN_RADIUS_M),
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
