"""What every environment shows, and how: pictures under `pixels`, joints under `agent_pos`."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np

OBS_TYPES = ("pixels_agent_pos", "agent_pos")
"""With pictures, and without: then no graphics context is made, and a step takes a fraction of the time."""


def observation_space(
    obs_type: str, *, size: tuple[int, int], cameras: Sequence[str], state_size: int
) -> gym.spaces.Dict:
    """Return the space of an environment's observations.

    Args:
        obs_type: One of `OBS_TYPES`.
        size: Height and width of every picture [px].
        cameras: Names of the pictures, each (H, W, 3) uint8.
        state_size: Length of `agent_pos`, float32.
    """
    spaces: dict[str, gym.Space[Any]] = {"agent_pos": gym.spaces.Box(-np.inf, np.inf, (state_size,), np.float32)}
    if obs_type == "pixels_agent_pos":
        image = gym.spaces.Box(0, 255, (*size, 3), np.uint8)
        spaces["pixels"] = gym.spaces.Dict(dict.fromkeys(cameras, image))
    return gym.spaces.Dict(spaces)
