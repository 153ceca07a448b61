"""Configuration of `--robot.type=excavator_sim`."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig


@RobotConfig.register_subclass("excavator_sim")
@dataclass(kw_only=True)
class ExcavatorSimConfig(ExcavatorSettings, SimulatedRobotConfig):
    """Set up the simulated excavator from LeRobot's command line; see both classes."""

    PREFIX: ClassVar[str] = "robot."
    IS_ENDLESS: ClassVar[bool] = True
