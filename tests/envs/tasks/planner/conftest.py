"""Piles as they are, and as the main camera sees them."""

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.planner.surface import MAP_CELL_M, SeenSurface, see_surface
from lerobot_excav.envs.tasks.scoop.scene import draw_scene

PICTURE_PX = (192, 256)


def surface_of(heights_m, is_seen=None):
    """Make a map, seen all over unless said otherwise, of heights (nx, ny)."""
    x_w, y_w = (MAP_CELL_M * (np.arange(n) + 0.5 - 0.5 * n) for n in heights_m.shape)
    seen = np.ones(heights_m.shape, dtype=bool) if is_seen is None else is_seen
    return SeenSurface(x_w=x_w, y_w=y_w, heights_m=heights_m, is_seen=seen)


def surface_of_scene(scene_set, scene_id):
    """Make a map of a scene's pile as it is, without a picture."""
    fine = draw_scene(scene_set, scene_id).heights_m
    return surface_of(fine.reshape(60, 2, 60, 2).mean(axis=(1, 3)))


@pytest.fixture(scope="session")
def worksite():
    return Worksite(fidelity="fast")


@pytest.fixture(scope="session")
def renderer(worksite):
    renderer = WorksiteRenderer(worksite, height=PICTURE_PX[0], width=PICTURE_PX[1])
    yield renderer
    renderer.close()


@pytest.fixture
def see(worksite, renderer):
    """Put the worksite into a scene, with the joints somewhere else if asked, and return what is seen of the soil."""

    def _see(scene_id, joint_pos=None):
        worksite.reset(draw_scene("train", scene_id))
        if joint_pos is not None:
            worksite.machine.reset(np.asarray(joint_pos, dtype=float))
        return see_surface(renderer.depth_m("main"), renderer.camera("main"))

    return _see
