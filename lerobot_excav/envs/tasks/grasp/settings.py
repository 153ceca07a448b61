"""The settings of the arm's tasks."""

from dataclasses import dataclass
from typing import ClassVar, override

from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import require
from lerobot_excav.setting import setting, with_default

EPISODE_DURATION_S = 8.0
"""Time limit unless another is asked for [s] (kind: paper, 400 frames at 50 Hz)."""


@dataclass(kw_only=True)
class FR5Settings(TaskSettings):
    """What a user may set about the arm; see `TaskSettings`."""

    ENV_TYPE: ClassVar[str] = "fr5_grasp"
    IS_ENDLESS: ClassVar[bool] = False
    """Whether somebody else ends the episodes, so that no frame is too late for a change of the command."""

    task: str = with_default(TaskSettings, "task", "FR5Grasp-v0")
    fps: int = with_default(TaskSettings, "fps", 50)
    retarget_frame: int | None = setting(
        "Frame before which another block is commanded; left out: never", default=None, low=1, high=2**31 - 1
    )

    @override
    def __post_init__(self) -> None:
        super().__post_init__()
        length = self.episode_length or round(EPISODE_DURATION_S * self.fps)
        require(
            self.retarget_frame is None or self.IS_ENDLESS or self.retarget_frame < length,
            f"{self.PREFIX}retarget_frame={self.retarget_frame} is not possible; give a whole number from 1 to "
            f"{length - 1}. An episode has {length} frames; leave it out to command one block only.",
        )
