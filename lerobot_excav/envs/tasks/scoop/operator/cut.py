"""The cut: down into thick soil, and on towards the machine until the bucket has swept its fill."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose, line
from lerobot_excav.envs.tasks.scoop.operator.section import STEP_M, Section
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation

# Numbers of the cut (kind: tuned on train scenes).
HOVER_HEIGHT_M = 0.45
HOVER_OUTWARDS_M = 0.1
FLOOR_CLEARANCE_M = 0.06
ENTRY_LENGTH_M = 0.35
"""Length over which the edge goes down to the full depth of cut [m]."""


def plan_cut(section: Section, variation: Variation) -> list[BucketPose]:
    """Plan the cut from above its entry, out of the soil."""
    heights = _cut_heights(section.radii_m, section.surface_m, variation.depth_m, variation.cut_volume_m3)
    pitches = np.linspace(variation.attack_pitch_rad, variation.roll_in_pitch_rad, heights.size)
    cut = [
        BucketPose(radius_m=float(r), height_m=float(z), pitch_rad=float(p), swing_rad=section.swing_rad)
        for r, z, p in zip(section.radii_m, heights, pitches, strict=False)
    ]
    return [*descent(cut[0], float(section.surface_m[0])), *cut[1:]]


def descent(entry: BucketPose, surface_m: float) -> list[BucketPose]:
    """Return the way from above the soil, whose surface has that height [m], down to the entry."""
    above = BucketPose(
        radius_m=entry.radius_m + HOVER_OUTWARDS_M,
        height_m=surface_m + HOVER_HEIGHT_M,
        pitch_rad=entry.pitch_rad,
        swing_rad=entry.swing_rad,
    )
    return line(above, entry, about_pin=False, samples=8)


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
        swept_m3 = np.cumsum(np.maximum(surface_m - heights, 0.0)) * STEP_M * BUCKET_INNER_WIDTH_M
        enough = np.nonzero(swept_m3 >= volume_m3)[0]
        if enough.size:
            return np.asarray(heights[: max(int(enough[0]) + 1, 3)])
    # The whole pile along this line is less than a bucket: stop where it ends.
    last = int(np.argmax(swept_m3 >= swept_m3[-1] - 1e-9))
    return np.asarray(heights[: max(last + 1, 3)])
