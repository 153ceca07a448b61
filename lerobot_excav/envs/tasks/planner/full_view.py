"""The planner's proposals for a pile of which every height is known, as a scene's stages need them."""

import numpy as np

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import Soil
from lerobot_excav.envs.tasks.planner.plan import plan_targets
from lerobot_excav.envs.tasks.planner.surface import MAP_CELL_M, SeenSurface
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M, Target
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE


def propose_regions(worksite: Worksite) -> tuple[Target, ...]:
    """Return as many regions as a scene has, in the order of the planner.

    Where the pile has fewer regions that are worth a cycle, the next best places follow, nearer to the others if they
    have to be.
    """
    plan = plan_targets(full_surface(worksite.soil))
    centers_w = [target.center_w for target in plan.targets]
    others_w = plan.candidates.centers_w[np.argsort(-plan.candidates.score, kind="stable")]
    for distance_m in (LEAST_DISTANCE_M, 0.5 * LEAST_DISTANCE_M):
        for center_w in others_w:
            if len(centers_w) == TARGETS_PER_SCENE:
                break
            if all(np.hypot(*(center_w - taken)[:2]) >= distance_m for taken in centers_w):
                centers_w.append(center_w.copy())
    for center_w in centers_w:
        center_w.flags.writeable = False  # starts are memoised
    return tuple(Target(center_w=center_w, yaw_rad=cylinder_from_world(center_w)[1]) for center_w in centers_w)


def full_surface(soil: Soil) -> SeenSurface:
    """Return the map of the dig area as it would be if every cell were seen: the mean height of each of its cells."""
    cells = round(MAP_CELL_M / float(soil.x_w[1] - soil.x_w[0]))
    nx, ny = (count // cells for count in soil.heights_m.shape)
    blocks = soil.heights_m.reshape(nx, cells, ny, cells)
    x_w, y_w = (axis.reshape(-1, cells).mean(axis=1) for axis in (soil.x_w, soil.y_w))
    return SeenSurface(x_w=x_w, y_w=y_w, heights_m=blocks.mean(axis=(1, 3)), is_seen=np.ones((nx, ny), dtype=np.bool_))
