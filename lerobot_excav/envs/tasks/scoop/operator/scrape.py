"""The scrape: soil of little height drawn together along the floor, with the bucket flat, and rolled in at the end."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M
from lerobot_excav.envs.tasks.scoop.operator.cut import ENTRY_LENGTH_M, descent
from lerobot_excav.envs.tasks.scoop.operator.path import BucketPose
from lerobot_excav.envs.tasks.scoop.operator.reach import within_reach
from lerobot_excav.envs.tasks.scoop.operator.section import STEP_M, Section
from lerobot_excav.envs.tasks.scoop.operator.shell import flattest_pitch_rad, hang_m
from lerobot_excav.envs.tasks.scoop.operator.variation import Variation

# Numbers of the scrape (kind: tuned on train scenes).
FLOOR_CLEARANCE_M = 0.003
"""Height of the lowest point of the shell over the rigid floor [m]; the edge is a plate's thickness higher."""
FLOOR_M = 0.02
"""Height of the edge at which it counts as down [m]: that of the level plate on the floor."""
VOLUME_M3 = 0.40
"""Soil to sweep at the most [m3]: along the floor a bucket loads less than in a cut, and pushes the rest ahead."""
ROLL_LENGTH_M = 0.1
"""Way of the edge while the bucket is rolled in [m]."""
_SMOOTHING = 5
"""Twice over so many points is the path smoothed."""


def plan_scrape(section: Section, variation: Variation) -> list[BucketPose]:
    """Plan the scrape from above its entry, out of the soil.

    The belly of the bucket stays off the floor as long as the edge is to stay down: it would lift the edge over soil as
    thin as this.
    """
    heights = _edge_heights(section, variation)
    wanted = np.linspace(variation.attack_pitch_rad, variation.roll_in_pitch_rad, heights.size)
    # Never flatter than what is still to come allows: a bucket that opens again on its way pours out what it has.
    flattest = np.maximum.accumulate(flattest_pitch_rad(heights)[::-1])[::-1]
    pitches = _smooth(np.maximum(wanted, flattest))
    down = np.where(heights <= FLOOR_M, 0.0, heights)
    heights = np.maximum(_smooth(down), hang_m(pitches) + FLOOR_CLEARANCE_M)
    scrape = [
        within_reach(BucketPose(radius_m=float(r), height_m=float(z), pitch_rad=float(p), swing_rad=section.swing_rad))
        for r, z, p in zip(section.radii_m, heights, pitches, strict=False)
    ]
    start = descent(scrape[0], float(section.surface_m[0]))
    return [*start, *scrape[1:], *_roll_in(scrape[-1], variation.roll_in_pitch_rad)]


def _edge_heights(section: Section, variation: Variation) -> NDArray[np.float64]:
    """Return the height of the edge [m], shape (k,), down to the floor until enough is swept or the soil ends."""
    way_m = section.radii_m[0] - section.radii_m
    ramp = np.minimum(way_m / ENTRY_LENGTH_M, 1.0)
    heights = np.maximum(section.mean_m - variation.depth_m * ramp, FLOOR_M)
    swept_m3 = np.cumsum(np.maximum(section.mean_m - heights, 0.0)) * STEP_M * BUCKET_INNER_WIDTH_M
    last = int(np.argmax(swept_m3 >= min(VOLUME_M3, float(swept_m3[-1]) - 1e-9)))
    return np.asarray(heights[: max(last + 1, 3)])


def _smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means over half a metre with more weight in the middle, so that no joint has to turn round at once."""
    weights = np.convolve(np.full(_SMOOTHING, 1.0 / _SMOOTHING), np.full(_SMOOTHING, 1.0 / _SMOOTHING))
    return np.convolve(np.pad(values, _SMOOTHING - 1, mode="edge"), weights, mode="valid")


def _roll_in(last: BucketPose, pitch_rad: float) -> list[BucketPose]:
    """Roll the bucket in at the end, with its belly gliding over the ground that the edge has left behind."""
    ground_m = last.height_m - float(hang_m(last.pitch_rad))
    poses = []
    for s in np.linspace(0.0, 1.0, 8)[1:].tolist():
        pitch = (1.0 - s) * last.pitch_rad + s * pitch_rad
        rolled = BucketPose(
            radius_m=last.radius_m - s * ROLL_LENGTH_M,
            height_m=ground_m + float(hang_m(pitch)),
            pitch_rad=pitch,
            swing_rad=last.swing_rad,
        )
        poses.append(within_reach(rolled))
    return poses
