"""What `--env.type=excavator` accepts, and what it tells LeRobot about the environment."""

from dataclasses import dataclass
from pathlib import Path

import draccus
import pytest
from lerobot.configs import FeatureType
from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import env_to_policy_features

from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError


def test_features_are_what_a_policy_sees() -> None:
    features = env_to_policy_features(ExcavatorEnvConfig(observation_height=64, observation_width=80))
    assert {key: (feature.type, tuple(feature.shape)) for key, feature in features.items()} == {
        "action": (FeatureType.ACTION, (4,)),
        "observation.state": (FeatureType.STATE, (8,)),
        "observation.images.main": (FeatureType.VISUAL, (3, 64, 80)),
        "observation.images.cab": (FeatureType.VISUAL, (3, 64, 80)),
        "observation.images.target_mask": (FeatureType.VISUAL, (3, 64, 80)),
    }


def test_features_follow_the_image_size_even_if_given() -> None:
    stale = ExcavatorEnvConfig(observation_height=64)
    config = ExcavatorEnvConfig(features=stale.features, features_map=stale.features_map)
    assert config.features["observation.images.main"].shape == (96, 128, 3)


def test_feature_names_can_be_recorded() -> None:
    config = ExcavatorEnvConfig()
    assert not [name for name in config.features if "/" in name]
    assert set(config.features) == set(config.features_map)


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("task", "Dance-v0", "Scoop-v0"),
        ("task", None, "Scoop-v0"),
        ("fps", 12, "10, 25"),
        ("fps", 0, "10, 25"),
        ("observation_height", 8, "32 to 1024"),
        ("observation_width", 4096, "32 to 1024"),
        ("scene_set", "exam", "'train', 'val', 'test'"),
        ("mask_condition", "none", "'correct', 'zero', 'random', 'mismatched'"),
        ("mask_noise", "blur", "'none', 'shift', 'erode', 'dilate'"),
        ("mask_noise", "shift", "from 1 pixel on"),
        ("mask_noise_px", 2, "or neither"),
        ("mask_noise_px", 0.5, "from 0 to 1024"),
        ("soil", "lava", "'sand', 'gravel', 'dirt', 'wet_sand'"),
        ("fidelity", "perfect", "'fast', 'standard', 'fine'"),
        ("fps", True, "10, 25"),
        ("fps", 10.0, "10, 25"),
        ("observation_height", 96.0, "32 to 1024"),
        ("render_mode", "human", "'rgb_array', None"),
        ("episode_length", 0, "from 1 on"),
        ("episode_length", 20.5, "from 1 on"),
        ("metrics_episodes", True, "--eval.n_episodes"),
        ("metrics_episodes", 0, "--eval.n_episodes"),
        ("metrics_episodes", 5, "--env.metrics_path"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(field: str, value: object, allowed: str) -> None:
    with pytest.raises(ConfigurationError) as raised:
        ExcavatorEnvConfig(**{field: value})
    assert f"env.{field}={value!r}" in str(raised.value)
    assert allowed in str(raised.value)


@pytest.mark.parametrize(
    ("field", "value"), [("fps", 12), ("fps", True), ("observation_width", 8), ("episode_length", 2.0)]
)
def test_the_environment_objects_in_the_same_words(field: str, value: object) -> None:
    with pytest.raises(ConfigurationError) as from_config:
        ExcavatorEnvConfig(**{field: value})
    with pytest.raises(ConfigurationError) as from_env:
        ExcavatorEnv(**{field: value})  # type: ignore[arg-type]
    assert str(from_config.value) == f"env.{from_env.value}"


def test_every_setting_reaches_the_environment() -> None:
    settings = {
        "task": "Scoop-v0",
        "fps": 25,
        "episode_length": 30,
        "observation_height": 64,
        "observation_width": 80,
        "scene_set": "test",
        "mask_condition": "random",
        "mask_noise": "dilate",
        "mask_noise_px": 3,
        "soil": "gravel",
        "fidelity": "fine",
    }
    config = ExcavatorEnvConfig(**settings)
    assert config.gym_kwargs == {**settings, "render_mode": "rgb_array"}
    assert config.gym_id == "lerobot_excav/Scoop-v0"


@dataclass
class Command:
    env: EnvConfig


def test_command_line_and_saved_configuration_give_the_same(tmp_path: Path) -> None:
    flags = ["--env.type=excavator", "--env.scene_set=val", "--env.metrics_path=m.jsonl"]
    config = draccus.parse(Command, args=[*flags, "--env.observation_width=160"]).env
    saved = tmp_path / "command.json"
    with saved.open("w") as file, draccus.config_type("json"):
        draccus.dump(Command(config), file)
    with draccus.config_type("json"):
        restored = draccus.parse(Command, config_path=saved, args=[]).env
    assert restored == config
    assert restored.gym_kwargs["observation_width"] == 160
