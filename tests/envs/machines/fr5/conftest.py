import pytest

from lerobot_excav.envs.tasks.grasp.scene import draw_scene


@pytest.fixture
def scene():
    return draw_scene("train", 0)


@pytest.fixture
def started(workcell, scene):
    """The work cell at the start of the scene."""
    workcell.reset(scene)
    return workcell
