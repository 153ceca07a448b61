"""A change of the command at a frame that the user names, in tasks that do not change it themselves."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, override

import numpy as np

from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import require
from lerobot_excav.setting import setting

_STREAM = 0x4E77  # names the random streams from which the second target is drawn


@dataclass(kw_only=True)
class RetargetSettings(TaskSettings):
    """Settings of a machine whose command may change once within an episode; see `TaskSettings`."""

    DURATION_S: ClassVar[float]
    """Time limit of the task that is asked for when none is named [s]."""
    IS_ENDLESS: ClassVar[bool] = False
    """Whether somebody else ends the episodes, so that no frame is too late for a change of the command."""

    retarget_frame: int | None = setting(
        "Frame before which another target is commanded, drawn from the others; left out: never",
        default=None,
        low=1,
        high=2**31 - 1,
    )

    @override
    def __post_init__(self) -> None:
        super().__post_init__()
        length = self.episode_length or round(self.DURATION_S * self.fps)
        require(
            self.retarget_frame is None or self.IS_ENDLESS or self.retarget_frame < length,
            f"{self.PREFIX}retarget_frame={self.retarget_frame} is not possible; give a whole number from 1 to "
            f"{length - 1}. An episode has {length} frames; leave it out to command one target only.",
        )


def second_target(scene_key: Sequence[int], target_id: int, count: int) -> int | None:
    """Draw another target of a start, by the start and its first target alone; None if there is no other.

    Args:
        scene_key: Numbers that tell the start from others.
        target_id: The first target.
        count: How many targets the start has.
    """
    others = [other for other in range(count) if other != target_id]
    if not others:
        return None
    rng = np.random.default_rng(np.random.SeedSequence(_STREAM, spawn_key=(*scene_key, target_id)))
    return int(rng.choice(others))
