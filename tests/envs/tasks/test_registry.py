"""Several tasks of one robot: their recordings have the same columns."""

from dataclasses import replace

import gymnasium as gym
import pytest

from lerobot_excav.envs.tasks import registry
from lerobot_excav.envs.tasks.registry import TASKS, register_task, task_of_robot
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import ConfigurationError, DatasetError


@pytest.fixture
def second_task(monkeypatch):
    """A second task of the excavator."""
    monkeypatch.setattr(registry, "TASKS", dict(TASKS))
    monkeypatch.setattr(gym, "register", lambda **_: None)
    second = replace(SCOOP, id="Second-v0", description="Another task.")
    register_task(second)
    return second


def test_a_task_is_found_by_robot_and_name_and_without_a_name_the_first(second_task):
    assert task_of_robot("excavator_sim", "Second-v0") is second_task
    assert task_of_robot("excavator_sim") is SCOOP


def test_a_task_that_the_robot_does_not_have_is_refused():
    with pytest.raises(DatasetError, match=r"excav\.task='FR5Grasp-v0' is not a task of robot_type='excavator_sim'"):
        task_of_robot("excavator_sim", "FR5Grasp-v0")


@pytest.mark.usefixtures("second_task")
@pytest.mark.parametrize(
    "difference", [{"state_names": ("swing.pos",)}, {"simulation_version": 99}, {"cameras": ("main", "target_mask")}]
)
def test_a_task_whose_recordings_would_have_other_columns_is_refused(difference):
    with pytest.raises(ConfigurationError, match=rf"has another {next(iter(difference))} than 'Scoop-v0'"):
        register_task(replace(SCOOP, id="Third-v0", **difference))
