"""Configuration of `--env.type=excavator` for the commands of LeRobot."""

from dataclasses import dataclass
from typing import Any, override

from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.masked_task import SimulationEnvConfig
from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.tasks.settings import EXCAVATOR_TASKS, FIDELITIES, SOILS
from lerobot_excav.errors import require_choice


@EnvConfig.register_subclass("excavator")
@dataclass
class ExcavatorEnvConfig(SimulationEnvConfig):
    """Set up the excavator environment from LeRobot's command line.

    Attributes:
        episode_length: Frames after which an unfinished episode is cut off; None: those of 20 s.
        soil: Soil preset.
        fidelity: Numerical effort of the soil: `fast`, `standard` or `fine`.
    """

    CAMERAS = CAMERAS
    STATE_SIZE = len(STATE_NAMES)
    ACTION_SIZE = len(ACTION_NAMES)
    TASKS = EXCAVATOR_TASKS

    task: str | None = "Scoop-v0"
    fps: int = 10
    soil: str = "sand"
    fidelity: str = "standard"

    @override
    def __post_init__(self) -> None:
        require_choice("env.soil", self.soil, SOILS)
        require_choice("env.fidelity", self.fidelity, FIDELITIES)
        super().__post_init__()

    def _own_kwargs(self) -> dict[str, Any]:
        return {"soil": self.soil, "fidelity": self.fidelity}
