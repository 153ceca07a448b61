"""The work cell, and episodes played without the environment around it."""

from dataclasses import dataclass

import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5.workcell import Workcell
from lerobot_excav.envs.tasks.grasp.operator import GraspOperator
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.envs.tasks.grasp.task import GraspTask


@dataclass
class OperatedCell:
    """The least that a scripted operator looks at."""

    workcell: object
    target_id: int
    fps: int = 50


def _play(workcell, scene_id, target_id, *, seed=0, frames=400, fps=50):
    """Let the operator play; returns the task, rewards and actions."""
    scene = draw_scene("train", scene_id)
    workcell.reset(scene)
    view = OperatedCell(workcell, target_id, fps)
    task = GraspTask(workcell, target_id)
    operator = GraspOperator(rng=np.random.default_rng(seed))
    operator.reset(view)
    rewards, actions = [], []
    for _ in range(frames):
        action = operator.act(view)
        for _ in range(50 // fps):
            workcell.tick(action)
        rewards.append(task.update())
        actions.append(action)
    return task, np.array(rewards), np.array(actions)


@pytest.fixture(scope="session")
def shared_workcell():
    return Workcell()


@pytest.fixture
def workcell(shared_workcell):
    """A work cell whose state any test may change: the next one resets it."""
    return shared_workcell


@pytest.fixture
def play(workcell):
    """Let the operator play in the shared work cell; see `_play`."""

    def play_here(*args, **kwargs):
        return _play(workcell, *args, **kwargs)

    return play_here
