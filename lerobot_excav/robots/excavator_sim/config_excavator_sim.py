"""Configuration of `--robot.type=excavator_sim`."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig

from lerobot_excav.envs.tasks.settings import EXCAVATOR_TASKS, FIDELITIES, SOILS, require_task
from lerobot_excav.errors import require_choice
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig


@RobotConfig.register_subclass("excavator_sim")
@dataclass(kw_only=True)
class ExcavatorSimConfig(SimulatedRobotConfig):
    """Set up the simulated excavator from LeRobot's command line.

    Attributes besides those of `SimulatedRobotConfig`:
        soil: Soil preset.
        fidelity: Numerical effort of the soil: `fast`, `standard` or `fine`.
        depth: Whether `ExcavatorSim.depth_m` offers the depth image registered with the main camera.
    """

    task: str = "Scoop-v0"
    fps: int = 10
    soil: str = "sand"
    fidelity: str = "standard"
    depth: bool = False

    def __post_init__(self) -> None:
        """Validate the fields.

        Raises:
            ConfigurationError: A field has a value that the simulation cannot use.
        """
        super().__post_init__()
        require_task("robot.task", self.task, EXCAVATOR_TASKS)
        require_choice("robot.soil", self.soil, SOILS)
        require_choice("robot.fidelity", self.fidelity, FIDELITIES)
