"""Configuration of `--robot.type=fr5_sim`."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.grasp.settings import FR5Settings
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig


@RobotConfig.register_subclass("fr5_sim")
@dataclass(kw_only=True)
class FR5SimConfig(FR5Settings, SimulatedRobotConfig):
    """Set up the simulated FR5 arm from LeRobot's command line; see both classes."""

    PREFIX: ClassVar[str] = "robot."
    IS_ENDLESS: ClassVar[bool] = True
