"""Configuration of `--robot.type=fr5_sim`."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.settings import FR5_TASKS
from lerobot_excav.errors import require_choice
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig


@RobotConfig.register_subclass("fr5_sim")
@dataclass(kw_only=True)
class FR5SimConfig(SimulatedRobotConfig):
    """Set up the simulated FR5 arm from LeRobot's command line; see `SimulatedRobotConfig`."""

    task: str = "FR5Grasp-v0"
    fps: int = 50

    def __post_init__(self) -> None:
        """Validate the fields.

        Raises:
            ConfigurationError: A field has a value that the simulation cannot use.
        """
        super().__post_init__()
        require_choice("robot.task", self.task, FR5_TASKS)
