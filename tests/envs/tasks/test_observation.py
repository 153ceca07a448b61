import gymnasium as gym
import numpy as np
import pytest

from lerobot_excav.envs.tasks.observation import OBS_TYPES, observation_space


@pytest.mark.parametrize("obs_type", OBS_TYPES)
def test_pictures_are_there_on_request(obs_type):
    space = observation_space(obs_type, size=(40, 60), cameras=("main", "side"), state_size=5)
    assert space["agent_pos"] == gym.spaces.Box(-np.inf, np.inf, (5,), np.float32)
    if obs_type == "agent_pos":
        assert set(space) == {"agent_pos"}
    else:
        pictures = space["pixels"]
        assert set(pictures) == {"main", "side"}
        image = gym.spaces.Box(0, 255, (40, 60, 3), np.uint8)
        assert all(space == image for space in pictures.values())
