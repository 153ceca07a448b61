"""Configuration of `--env.type=toy_reach` for LeRobot's commands."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.masked_task import MaskedTaskEnvConfig
from toy_reach.spec import ReachSettings


@EnvConfig.register_subclass("toy_reach")
@dataclass(kw_only=True)
class ReachEnvConfig(ReachSettings, MaskedTaskEnvConfig):
    """Set up the toy task from LeRobot's command line."""

    PREFIX: ClassVar[str] = "env."
