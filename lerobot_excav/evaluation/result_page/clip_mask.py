"""The mask that an episode was shown, drawn anew from its scene and target."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import lerobot_excav.envs  # noqa: F401 - registers the environments
from lerobot_excav.evaluation.episode import EpisodeKey
from lerobot_excav.evaluation.run import Run

# They say nothing of a mask that is shown from the start.
_NO_ARGUMENTS = ("simulation_version", "retarget_frame")


@dataclass(frozen=True, kw_only=True)
class ShownMask:
    """A mask and the frame from which it was shown.

    Attributes:
        since: First frame.
        pixels: Which pixels it marks, bool (H, W).
    """

    since: int
    pixels: NDArray[np.bool_]


def shown_masks(run: Run, key: EpisodeKey, *, height: int, width: int) -> list[ShownMask]:
    """Draw the masks of an episode, in the order in which they were shown.

    After a change of the command the mask is that of the new target as the scene was at the start.

    Args:
        run: The evaluation.
        key: The episode.
        height: Height of the picture [px].
        width: Width of the picture [px].

    Raises:
        RenderingError: Pictures cannot be made on this machine.
    """
    episode = run.evaluations[0].episodes[key]
    arguments = {name: value for name, value in run.constants.items() if name not in _NO_ARGUMENTS}
    env = gym.make(
        f"lerobot_excav/{run.table.task}",
        disable_env_checker=True,
        scene_set=key.scene_set,
        observation_height=height,
        observation_width=width,
        **arguments,
    )
    shown = {0: key.target_id}
    if (change := run.constants.get("retarget_frame")) is not None:
        shown[change] = getattr(episode, "final_target_id")  # noqa: B009 - a field of some tasks only
    masks = [
        ShownMask(since=since, pixels=_mask(env, key.scene_id, target_id))
        for since, target_id in shown.items()
    ]
    env.close()
    return masks


def _mask(env: "gym.Env[Any, Any]", scene_id: int, target_id: int) -> NDArray[np.bool_]:
    observation, _ = env.reset(options={"scene_id": scene_id, "target_id": target_id})
    return np.asarray(observation["pixels"]["target_mask"][..., 0] > 127)
