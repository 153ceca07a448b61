"""What `--env.type` accepts, and what it tells LeRobot about the environment, for every task."""

from dataclasses import dataclass
from pathlib import Path

import draccus
import pytest
from lerobot.configs import FeatureType
from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import env_to_policy_features

import lerobot_excav.plugin  # noqa: F401 - registers every --env.type
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

SPECS = [spec for spec in TASKS.values() if spec.settings.__module__.startswith("lerobot_excav.")]


@dataclass
class Command:
    env: EnvConfig


@pytest.fixture(params=SPECS, ids=[spec.id for spec in SPECS])
def spec(request):
    return request.param


def config_of(spec, **settings):
    return EnvConfig.get_choice_class(spec.env_type)(task=spec.id, **settings)


def test_features_are_what_a_policy_sees(spec):
    features = env_to_policy_features(config_of(spec, observation_height=64, observation_width=80))
    assert {key: (feature.type, tuple(feature.shape)) for key, feature in features.items()} == {
        "action": (FeatureType.ACTION, (len(spec.action_names),)),
        "observation.state": (FeatureType.STATE, (len(spec.state_names),)),
        **{f"observation.images.{camera}": (FeatureType.VISUAL, (3, 64, 80)) for camera in spec.cameras},
    }


def test_features_follow_the_image_size_and_can_be_recorded(spec):
    stale = config_of(spec, observation_height=64)
    config = config_of(spec, features=stale.features, features_map=stale.features_map)
    assert config.features["observation.images.main"].shape == (96, 128, 3)
    assert not [name for name in config.features if "/" in name]
    assert set(config.features) == set(config.features_map)


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("task", "Dance-v0", "-v0"),
        ("task", None, "a text"),
        ("fps", 12, "10, 25"),
        ("fps", True, "10, 25"),
        ("fps", 10.0, "10, 25"),
        ("observation_height", 8, "32 to 1024"),
        ("observation_width", 96.0, "32 to 1024"),
        ("scene_set", "exam", "train, val, test"),
        ("mask_source", "guess", "oracle"),
        ("mask_condition", "none", "correct, zero, random, mismatched"),
        ("mask_noise", "blur", "none, shift, erode, dilate"),
        ("mask_noise", "shift", "from 1 pixel on"),
        ("mask_noise_px", 2, "or neither"),
        ("mask_noise_px", float("nan"), "0 to 1024"),
        ("target_overlay", "yes", "true or false"),
        ("render_mode", "human", "rgb_array"),
        ("episode_length", 0, "from 1 on"),
        ("metrics_episodes", True, "from 1 on"),
        ("metrics_episodes", 5, "--env.metrics_path"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(spec, field, value, allowed):
    with pytest.raises(ConfigurationError) as raised:
        EnvConfig.get_choice_class(spec.env_type)(**{field: value})
    assert f"env.{field}={value!r}" in str(raised.value)
    assert allowed in str(raised.value)


NOISE_ON_NOTHING = {"mask_noise": "shift", "mask_noise_px": 2, "mask_condition": "zero"}


@pytest.mark.parametrize("settings", [{"fps": 12}, {"fps": True}, {"episode_length": 2.0}, NOISE_ON_NOTHING])
def test_the_environment_objects_in_the_same_words(spec, settings):
    with pytest.raises(ConfigurationError) as from_config:
        config_of(spec, **settings)
    with pytest.raises(ConfigurationError) as from_env:
        spec.make_env(**settings)
    assert str(from_config.value).startswith("env.")
    assert str(from_config.value).replace("env.", "") == str(from_env.value)


def test_every_setting_reaches_the_environment(spec):
    settings = {
        "fps": 25,
        "episode_length": 30,
        "observation_height": 64,
        "observation_width": 80,
        "scene_set": "test",
        "mask_condition": "random",
        "mask_noise": "dilate",
        "mask_noise_px": 3,
        "target_overlay": True,
    }
    rendered = {"render_height": 64, "render_width": 80, "render_camera": "main"}
    vector = config_of(spec, **settings, **rendered).create_envs(1)[spec.env_type][0]
    env = vector.envs[0].unwrapped
    assert {name: getattr(env.settings, name) for name in settings} == settings
    assert {name: getattr(env.render_settings, name) for name in rendered} == rendered
    assert (env.fps, env.episode_length, env.task) == (25, 30, spec.id)
    vector.close()


def test_command_line_and_saved_configuration_give_the_same(spec, tmp_path: Path):
    flags = [f"--env.type={spec.env_type}", "--env.scene_set=val", "--env.metrics_path=m.jsonl"]
    config = draccus.parse(Command, args=[*flags, "--env.observation_width=160"]).env
    saved = tmp_path / "command.json"
    with saved.open("w") as file, draccus.config_type("json"):
        draccus.dump(Command(config), file)
    with draccus.config_type("json"):
        restored = draccus.parse(Command, config_path=saved, args=[]).env
    assert restored == config
    assert restored.gym_kwargs["observation_width"] == 160


@pytest.mark.parametrize(
    ("env_type", "settings", "named"),
    [
        ("excavator", {"soil": "lava"}, "env.soil='lava' is not possible; give one of sand, gravel, dirt, wet_sand"),
        ("excavator", {"fidelity": "perfect"}, "one of fast, standard, fine"),
        ("fr5_grasp", {"retarget_frame": 400}, "env.retarget_frame=400 is not possible"),
        ("fr5_grasp", {"retarget_frame": 0}, "env.retarget_frame=0 is not possible"),
        ("fr5_grasp", {"retarget_frame": 20, "episode_length": 20}, "env.retarget_frame=20"),
        ("excavator", {"retarget_frame": 200}, "env.retarget_frame=200 is not possible"),
        ("excavator", {"retarget_frame": 5, "task": "Clear-v0"}, "env.retarget_frame=5 has no effect with env.task="),
        ("fr5_grasp", {"task": "Scoop-v0"}, "env.task='Scoop-v0'"),
    ],
)
def test_a_tasks_own_settings_are_checked(env_type, settings, named):
    with pytest.raises(ConfigurationError, match=named):
        EnvConfig.get_choice_class(env_type)(**settings)
