"""The settings of the arm's tasks."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot_excav.envs.tasks.retarget import RetargetSettings
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.setting import with_default

EPISODE_DURATION_S = 8.0
"""Time limit unless another is asked for [s] (kind: paper, 400 frames at 50 Hz)."""


@dataclass(kw_only=True)
class FR5Settings(RetargetSettings):
    """What a user may set about the arm; see `TaskSettings`."""

    ENV_TYPE: ClassVar[str] = "fr5_grasp"
    DURATION_S: ClassVar[float] = EPISODE_DURATION_S

    task: str = with_default(TaskSettings, "task", "FR5Grasp-v0")
    fps: int = with_default(TaskSettings, "fps", 50)
