"""Configuration of `--env.type=fr5_grasp` for the commands of LeRobot."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.masked_task import MaskedTaskEnvConfig
from lerobot_excav.envs.tasks.grasp.settings import FR5Settings


@EnvConfig.register_subclass("fr5_grasp")
@dataclass(kw_only=True)
class FR5GraspEnvConfig(FR5Settings, MaskedTaskEnvConfig):
    """Set up the FR5 grasping environment from LeRobot's command line; see both classes."""

    PREFIX: ClassVar[str] = "env."
