"""The planner's scores, drawn into the main picture."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.overlay import tinted
from lerobot_excav.envs.tasks.planner.plan import Plan
from lerobot_excav.envs.tasks.planner.surface import SeenSurface

WORST_RGB, BEST_RGB = (40, 60, 160), (250, 220, 50)
_OPACITY = 0.45


def with_scores(
    picture: NDArray[np.uint8],
    depth_m: NDArray[np.floating],
    camera: PinholeCamera,
    *,
    surface: SeenSurface,
    plan: Plan,
) -> NDArray[np.uint8]:
    """Return a main picture (H, W, 3) on which every possible place has the colour of its score, from blue to yellow.

    The planner's choice is tinted as a target is. `depth_m` (H, W) [m] and `camera` belong to the picture; pixels above
    the surface, which show the machine, keep their colour.
    """
    points_w = camera.points_w(depth_m)
    cells = surface.cells_at(points_w)
    score = _score_map(surface, plan)[cells]
    is_soil = surface.covers(points_w) & (points_w[..., 2] < surface.heights_m[cells] + surface.cell_m)
    shown = is_soil & np.isfinite(score)
    result = picture.copy()
    if shown.any():
        colour = _colours(score[shown])
        result[shown] = ((1.0 - _OPACITY) * picture[shown] + _OPACITY * colour).astype(np.uint8)
    if not plan.proposals:
        return result
    return tinted(result, plan.proposals[0].target.contains(points_w) & is_soil)


def _score_map(surface: SeenSurface, plan: Plan) -> NDArray[np.float64]:
    """Return the scores of the possible places in their cells (nx, ny) [m3]; NaN elsewhere."""
    possible = plan.candidates.is_possible
    scores = np.full(surface.heights_m.shape, np.nan)
    scores[surface.cells_at(plan.candidates.centers_w[possible])] = plan.candidates.score[possible]
    return scores


def _colours(score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return colours (n, 3) from the worst to the best of the scores."""
    span = max(float(np.ptp(score)), 1e-9)
    share = ((score - score.min()) / span)[:, None]
    return np.asarray((1.0 - share) * np.array(WORST_RGB) + share * np.array(BEST_RGB))
