"""Places at which the next cut could begin, and what speaks for each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M, MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import world_from_cylinder
from lerobot_excav.envs.tasks.planner.keep_out import is_barred
from lerobot_excav.envs.tasks.planner.surface import SeenSurface
from lerobot_excav.envs.tasks.planner.zones import Zone
from lerobot_excav.envs.tasks.scoop.feasibility import PATCH_SIZE_M
from lerobot_excav.envs.tasks.scoop.operator.dig import end_radius_m

RADIUS_RANGE_M = (2.9, 6.2)
"""Distance of a region's centre from the swing axis [m] (kind: tuned on train scenes). Near the machine lies what the
cuts before have pushed there."""

# The cut that is imagined at every place (kind: tuned on train scenes, as all below).
CUT_LENGTH_M = 2.5
CUT_DEPTH_M = 0.41
ENTRY_LENGTH_M = 0.35
"""Length over which the edge goes down to that depth [m]."""
ENTRY_AHEAD_M = 0.2
"""How far behind the centre of the region the cut begins, seen from the machine [m]."""
FLOOR_CLEARANCE_M = 0.01
FULL_BUCKET_M3 = 0.42
"""More soil along the cut makes a place no better [m3]."""
LENGTH_COST_M2 = 0.02
"""What a longer way to as much soil as the cut holds costs [m3 per m]: it decides between places with equal soil."""
RADIUS_COST_M2 = 0.001
HEIGHT_GAIN_M2 = 0.001
"""What a place farther away costs, and a higher one gains [m3 per m]: these decide where the soil is the same."""

ONSET_M3 = 0.017
LONGEST_ONSET_M = 0.35
"""Loading has to begin inside the region: 25 kg of sand within this length of the cut [m3, m]."""
LEAST_SWEPT_M3 = 0.03
"""Less soil along the cut is not worth a cycle [m3]; 44 kg of sand (kind: guess)."""
LEAST_SEEN_SHARE = 0.5
"""Part of the cut's cells that has to be seen (kind: guess)."""

VAIN_COST_M3 = 1.0
"""What a cycle that brought nothing costs the places around it [m3]: more than any of them can gain, so they come after
all others, and before nothing at all (kind: derived)."""

KEEP_OUT_RADIUS_M = 2.0
"""How far towards the machine the bucket may go while it cuts or is drawn in; a keep-out zone bars all of it [m]."""

_STEP_M = 0.05
_LANES = (-0.375, -0.125, 0.125, 0.375)  # across the bucket, in widths of it


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Places on the raster of the map within reach, and what is known of each; arrays of length n.

    Attributes:
        centers_w: Centres of the regions on the surface (n, 3) [m], world frame.
        radius_m: Distance from the swing axis [m].
        swept_m3: Soil within the cut [m3].
        onset_m: Length of the cut after which loading has begun [m]; infinite if it does not.
        seen_share: Part of the cut's cells that is seen.
        is_barred: Whether a keep-out zone bars it.
        vain_tries: Number of cycles on a region that overlaps its own which brought nothing.
        score: How good it is [m3].
    """

    centers_w: NDArray[np.float64]
    radius_m: NDArray[np.float64]
    swept_m3: NDArray[np.float64]
    onset_m: NDArray[np.float64]
    seen_share: NDArray[np.float64]
    is_barred: NDArray[np.bool_]
    vain_tries: NDArray[np.intp]
    score: NDArray[np.float64]

    @property
    def is_possible(self) -> NDArray[np.bool_]:
        """Whether it may be dug and is worth a cycle."""
        worth = (self.swept_m3 >= LEAST_SWEPT_M3) & (self.onset_m <= LONGEST_ONSET_M)
        return np.asarray(worth & (self.seen_share >= LEAST_SEEN_SHARE) & ~self.is_barred)


def find_candidates(
    surface: SeenSurface, keep_out: Sequence[Zone] = (), vain_w: Sequence[NDArray[np.float64]] = ()
) -> Candidates:
    """Imagine a cut at every cell within reach."""
    x_w, y_w = np.meshgrid(surface.x_w, surface.y_w, indexing="ij")
    centers_w = np.stack([x_w, y_w, surface.heights_m], axis=-1).reshape(-1, 3)
    radius = np.hypot(*(centers_w[:, :2] - np.asarray(MACHINE_POS_W[:2])).T)
    low, high = RADIUS_RANGE_M
    centers_w = centers_w[(low <= radius) & (radius <= high)]
    return rate(centers_w, surface, keep_out, vain_w)


def rate(
    centers_w: NDArray[np.float64],
    surface: SeenSurface,
    keep_out: Sequence[Zone] = (),
    vain_w: Sequence[NDArray[np.float64]] = (),
) -> Candidates:
    """Imagine a cut at given places (n, 3) [m], whoever proposes them.

    `vain_w` are the centres (3,) [m] of regions on which cycles brought nothing.
    """
    offset = centers_w[:, :2] - np.asarray(MACHINE_POS_W[:2])
    radius, swing = np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])
    gone = np.arange(0.0, CUT_LENGTH_M, _STEP_M)
    radii = radius[:, None] + ENTRY_AHEAD_M - gone
    surface_m, seen = _along_the_cut(surface, radii, swing)
    floor_m = np.maximum(surface_m - CUT_DEPTH_M * np.minimum(gone / ENTRY_LENGTH_M, 1.0), FLOOR_CLEARANCE_M)
    is_cut = radii >= end_radius_m(radii[:, :1])
    cut_m = np.where(is_cut, np.maximum(surface_m - floor_m, 0.0), 0.0)
    swept_m3 = np.cumsum(cut_m, axis=1) * _STEP_M * BUCKET_INNER_WIDTH_M
    total_m3 = np.minimum(swept_m3[:, -1], FULL_BUCKET_M3)
    begun = swept_m3 >= ONSET_M3
    onset_m = np.where(begun.any(axis=1), begun.argmax(axis=1) * _STEP_M, np.inf)
    filled_m = (swept_m3 < total_m3[:, None] - 1e-9).sum(axis=1) * _STEP_M
    vain_tries = _vain_tries(centers_w, vain_w)
    gain_m3 = total_m3 - LENGTH_COST_M2 * filled_m - RADIUS_COST_M2 * radius + HEIGHT_GAIN_M2 * centers_w[:, 2]
    return Candidates(
        centers_w=centers_w,
        radius_m=radius,
        swept_m3=swept_m3[:, -1],
        onset_m=onset_m,
        seen_share=(seen * is_cut).sum(axis=1) / np.maximum(is_cut.sum(axis=1), 1),
        is_barred=is_barred(centers_w, keep_out, inner_radius_m=KEEP_OUT_RADIUS_M, half_size_m=0.5 * PATCH_SIZE_M),
        vain_tries=vain_tries,
        score=gain_m3 - VAIN_COST_M3 * vain_tries,
    )


def _vain_tries(centers_w: NDArray[np.float64], vain_w: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    tries = np.zeros(len(centers_w), dtype=np.intp)
    for place_w in vain_w:
        tries += np.hypot(*(centers_w[:, :2] - place_w[:2]).T) < PATCH_SIZE_M
    return tries


def _along_the_cut(
    surface: SeenSurface, radii: NDArray[np.float64], swing: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean height over the bucket's width along cuts [m], and what part of it is seen; each (n, steps)."""
    heights, seen = np.zeros_like(radii), np.zeros_like(radii)
    for lane in _LANES:
        aside = lane * BUCKET_INNER_WIDTH_M / np.maximum(radii, 1.0)
        points_w = world_from_cylinder(radii, swing[:, None] + aside)
        cells, inside = surface.cells_at(points_w), surface.covers(points_w)
        heights += np.where(inside, surface.heights_m[cells], 0.0) / len(_LANES)
        seen += (surface.is_seen[cells] | ~inside) / len(_LANES)
    return heights, seen
