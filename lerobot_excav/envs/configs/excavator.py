"""Configuration of `--env.type=excavator` for the commands of LeRobot."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.masked_task import MaskedTaskEnvConfig
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings


@EnvConfig.register_subclass("excavator")
@dataclass(kw_only=True)
class ExcavatorEnvConfig(ExcavatorSettings, MaskedTaskEnvConfig):
    """Set up the excavator environment from LeRobot's command line; see both classes."""

    PREFIX: ClassVar[str] = "env."
