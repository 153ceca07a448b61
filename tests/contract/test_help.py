"""Every option of this package says on the command line what it means and what it may be."""

import dataclasses

import pytest
from lerobot.configs import PreTrainedConfig
from lerobot.envs.configs import EnvConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401 - registers every type
from lerobot_excav.setting import declared_settings

KINDS = {"env": EnvConfig, "robot": RobotConfig, "teleop": TeleoperatorConfig, "policy": PreTrainedConfig}
CONFIGS = {
    f"--{kind}.type={name}": config
    for kind, registry in KINDS.items()
    for name, config in registry.get_known_choices().items()
    if config.__module__.startswith("lerobot_excav.")
}
LEROBOTS_OWN = {"id", "calibration_dir", "input_features", "output_features"}


@pytest.mark.parametrize("config", CONFIGS.values(), ids=CONFIGS)
def test_every_field_is_explained_with_its_choices(config):
    allowed = declared_settings(config)
    for field in dataclasses.fields(config):
        if field.name in LEROBOTS_OWN:
            continue
        text = field.metadata["custom_args"]["help"]
        assert len(text) > 10, field.name
        choices = allowed[field.name].choices if field.name in allowed else None
        values = () if callable(choices) else choices
        assert all(str(value) in text for value in values or ()), field.name
