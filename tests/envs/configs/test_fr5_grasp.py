from dataclasses import dataclass

import draccus
import pytest
from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.fr5_grasp import FR5GraspEnvConfig
from lerobot_excav.errors import ConfigurationError


def test_features_are_what_a_policy_sees():
    config = FR5GraspEnvConfig()
    assert config.features["action"].shape == (7,)
    assert config.features["agent_pos"].shape == (7,)
    assert config.features["observation.images.top"].shape == (96, 128, 3)
    assert set(config.features_map) == set(config.features)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"mask_noise": "erode"}, "env.mask_noise"),
        ({"mask_noise_px": 2}, "env.mask_noise"),
        ({"retarget_frame": 500}, "env.retarget_frame"),
        ({"task": "Scoop-v0"}, "env.task"),
        ({"fps": 60}, "env.fps"),
    ],
)
def test_an_impossible_value_is_named(settings, named):
    with pytest.raises(ConfigurationError, match=named):
        FR5GraspEnvConfig(**settings)


def test_every_setting_reaches_the_environment():
    config = FR5GraspEnvConfig(
        mask_noise="shift",
        mask_noise_px=3,
        retarget_frame=20,
        scene_set="test",
        mask_condition="random",
        fps=25,
    )
    vector = config.create_envs(1)["fr5_grasp"][0]
    env = vector.envs[0].unwrapped
    assert (env.mask_noise, env.mask_noise_px, env.retarget_frame) == ("shift", 3, 20)
    assert (env.scene_set, env.mask_condition, env.fps, env.episode_length) == ("test", "random", 25, 200)
    vector.close()


@dataclass
class Command:
    env: EnvConfig


def test_the_command_line_knows_it():
    config = draccus.parse(Command, args=["--env.type=fr5_grasp", "--env.retarget_frame=25"]).env
    assert isinstance(config, FR5GraspEnvConfig)
    assert config.retarget_frame == 25
