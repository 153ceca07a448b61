"""`obs_type="state"`: what pictures show, as numbers, for reinforcement learning."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from toy_reach.spec import REACH

import lerobot_excav  # noqa: F401 - registers the ids
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

OFFERING = sorted(spec.id for spec in TASKS.values() if spec.environment_state_names)


def made(task, **settings):
    return gym.make(TASKS[task].gym_id, obs_type="state", render_mode=None, disable_env_checker=True, **settings)


def test_every_task_of_this_package_offers_it():
    assert {"Scoop-v0", "Clear-v0", "FR5Grasp-v0"} <= set(OFFERING)


# Positions and velocities have no bound that a box could state; an arm is commanded in radians.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*Box observation space m.* value is .*infinity:UserWarning")
@pytest.mark.filterwarnings("ignore:.*For Box action spaces, we recommend:UserWarning")
@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("task", OFFERING)
def test_gymnasium_finds_nothing_wrong(task):
    env = made(task)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("task", OFFERING)
def test_every_element_has_a_name_of_its_own(task):
    env = made(task)
    observation, _ = env.reset(seed=3)
    names = TASKS[task].environment_state_names
    assert observation["environment_state"].shape == (len(names),)
    assert len(set(names)) == len(names)
    env.close()


@pytest.mark.parametrize("task", OFFERING)
def test_another_target_changes_what_is_said_of_the_target_alone(task):
    env = made(task)
    first, second = (
        env.reset(options={"scene_id": 3, "target_id": target})[0]["environment_state"] for target in (0, 1)
    )
    names = np.array(TASKS[task].environment_state_names)
    differing = names[first != second]
    assert differing.size
    assert all(name.startswith("target.") for name in differing)
    env.close()


@pytest.mark.parametrize(
    "setting",
    [
        {"mask_condition": "zero"},
        {"mask_noise": "shift", "mask_noise_px": 2},
        {"target_overlay": True},
        {"mask_dropout": 0.5},
    ],
)
def test_a_mask_that_nobody_sees_cannot_be_corrupted(setting):
    with pytest.raises(ConfigurationError, match=rf"{next(iter(setting))}=.* has no effect with obs_type='state'"):
        made("Scoop-v0", **setting)


def test_a_mask_that_nobody_sees_cannot_be_snapped():
    with pytest.raises(ConfigurationError, match=r"mask_snap=True has no effect with obs_type='state'"):
        made("FR5Grasp-v0", mask_snap=True)


def test_a_task_that_names_no_elements_refuses_it():
    assert not REACH.environment_state_names
    with pytest.raises(ConfigurationError, match=r"obs_type='state'.*'pixels_agent_pos', 'agent_pos'"):
        REACH.make_env(obs_type="state")
