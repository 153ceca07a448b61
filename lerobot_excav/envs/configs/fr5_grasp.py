"""Configuration of `--env.type=fr5_grasp` for the commands of LeRobot."""

from dataclasses import dataclass
from typing import Any, override

from lerobot.envs.configs import EnvConfig

from lerobot_excav.envs.configs.masked_task import SimulationEnvConfig
from lerobot_excav.envs.machines.fr5.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.tasks.settings import FR5_EPISODE_DURATION_S, FR5_TASKS, require_retarget_frame


@EnvConfig.register_subclass("fr5_grasp")
@dataclass
class FR5GraspEnvConfig(SimulationEnvConfig):
    """Set up the FR5 grasping environment from LeRobot's command line.

    Attributes:
        episode_length: Frames of an episode, which never ends earlier; None: those of 8 s.
        retarget_frame: Frame before which another block is commanded; None: never.
    """

    CAMERAS = CAMERAS
    STATE_SIZE = len(STATE_NAMES)
    ACTION_SIZE = len(ACTION_NAMES)
    TASKS = FR5_TASKS

    task: str | None = "FR5Grasp-v0"
    fps: int = 50
    retarget_frame: int | None = None

    @override
    def __post_init__(self) -> None:
        super().__post_init__()
        length = self.episode_length or round(FR5_EPISODE_DURATION_S * self.fps)
        require_retarget_frame("env.retarget_frame", self.retarget_frame, length)

    def _own_kwargs(self) -> dict[str, Any]:
        return {"retarget_frame": self.retarget_frame}
