"""Which regions of a worked pile are proposed next, from the heights of the soil."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import BUCKET_INNER_WIDTH_M, MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world, world_from_cylinder
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M, Target
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE

# Numbers of the rule (kind: tuned on train and val scenes in a feasibility study).
RADIUS_RANGE_M = (3.3, 6.2)
CUT_LENGTH_M = 1.5
ENTRY_LENGTH_M = 0.35
CUT_DEPTH_M = 0.41
FLOOR_CLEARANCE_M = 0.03
LEAST_RADIUS_M = 2.4
FULL_M3 = 0.42
ONSET_M3 = 0.017
"""Soil that counts as loading, 25 kg of sand [m3]; it must lie within `ONSET_LENGTH_M` of the entry."""
ONSET_LENGTH_M = 0.3
LENGTH_COST_M3_M = 0.02
"""What a metre of cut costs against soil [m3/m]: among full buckets the shortest way wins."""

_RASTER_CELLS = 2
_STEP_M = 0.05
_ENTRY_OFFSET_M = 0.08
_ACROSS_M = BUCKET_INNER_WIDTH_M * np.array([-0.375, -0.125, 0.125, 0.375])


def propose_most_soil(worksite: Worksite) -> tuple[Target, ...]:
    """Return as many regions as a scene has, the one with most soil within a cut first, and lying apart if they can.

    Regions where loading would begin only outside of the patch come last.
    """
    centers_w, scores = _scored_centers(worksite.soil)
    order = np.argsort(-scores, kind="stable")
    picked: list[int] = []
    for distance_m in (LEAST_DISTANCE_M, 0.5 * LEAST_DISTANCE_M, 0.0):
        for i in order.tolist():
            if len(picked) == TARGETS_PER_SCENE:
                break
            apart = np.linalg.norm(centers_w[picked, :2] - centers_w[i, :2], axis=1) >= distance_m
            if i not in picked and bool(apart.all()):
                picked.append(i)
    return tuple(Target(center_w=centers_w[i].copy(), yaw_rad=cylinder_from_world(centers_w[i])[1]) for i in picked)


def _scored_centers(soil: Soil) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return candidates (n, 3) [m] on a raster within reach, and how good a cut from each would be (n,) [m3]."""
    heights, step = soil.heights_m, _RASTER_CELLS
    ix, iy = (axis.ravel() for axis in np.mgrid[: heights.shape[0] : step, : heights.shape[1] : step])
    centers_w = np.stack([soil.x_w[ix], soil.y_w[iy], heights[ix, iy]], axis=-1)
    radii = np.hypot(*(centers_w[:, :2] - MACHINE_POS_W[:2]).T)
    centers_w = centers_w[(RADIUS_RANGE_M[0] <= radii) & (radii <= RADIUS_RANGE_M[1])]
    swept_m3 = _swept_m3(soil, centers_w)
    total_m3 = swept_m3[:, -1]
    length_m = (swept_m3 < np.minimum(FULL_M3, total_m3 - 1e-3)[:, None]).sum(axis=1) * _STEP_M
    onset_m = (swept_m3 < ONSET_M3).sum(axis=1) * _STEP_M
    scores = np.minimum(total_m3, FULL_M3) - LENGTH_COST_M3_M * length_m
    return centers_w, scores - 1.0 * (onset_m > ONSET_LENGTH_M)


def _swept_m3(soil: Soil, centers_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the soil that cuts from regions (n, 3) [m] have swept after every step, (n, steps) [m3]."""
    offsets_w = centers_w[:, :2] - MACHINE_POS_W[:2]
    ahead_m = np.arange(0.0, CUT_LENGTH_M + 1e-9, _STEP_M)
    radii = np.hypot(*offsets_w.T)[:, None] + _ENTRY_OFFSET_M - ahead_m
    swings = np.arctan2(offsets_w[:, 1], offsets_w[:, 0])[:, None]
    lanes = [soil.height_at(world_from_cylinder(radii, swings + across / radii)) for across in _ACROSS_M]
    surface_m = np.mean(lanes, axis=0)
    edge_m = np.maximum(surface_m - CUT_DEPTH_M * np.minimum(ahead_m / ENTRY_LENGTH_M, 1.0), FLOOR_CLEARANCE_M)
    cut_m = np.where(radii >= LEAST_RADIUS_M, np.maximum(surface_m - edge_m, 0.0), 0.0)
    return np.asarray(np.cumsum(cut_m, axis=1) * _STEP_M * BUCKET_INNER_WIDTH_M)
