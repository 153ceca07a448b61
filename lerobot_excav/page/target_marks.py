"""Where the targets that can be commanded lie in the main picture."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv

Mark = dict[str, Any]


def target_marks(env: MaskedTaskEnv[Any, Any]) -> list[Mark]:
    """Return the targets of the scene: `number`, middle `x`, `y` and `outline` [[x, y], ...], each from 0 to 1.

    Those out of sight are left out, and places that were pointed at before, but for the one that is commanded.
    """
    count = env.task_spec.target_count
    others = [command for command in env.other_commands() if command.target_id < count]
    commands = sorted([env.command, *others], key=lambda command: command.target_id)
    marks = []
    for command in commands:
        pixels = env.true_mask(command)
        if pixels.any():
            marks.append({"number": command.target_id, **_shape(pixels)})
    return marks


def _shape(pixels: NDArray[np.bool_]) -> dict[str, Any]:
    size = np.array(pixels.shape)[::-1]
    points = np.argwhere(pixels)[:, ::-1]
    x, y = ((points.mean(axis=0) + 0.5) / size).tolist()
    corners = np.unique(np.concatenate([points + np.array([i, j]) for i in (0, 1) for j in (0, 1)]), axis=0)
    try:
        hull = corners[ConvexHull(corners).vertices]
    except QhullError:  # cannot be: the corners of a pixel span an area
        hull = corners
    return {"x": round(x, 4), "y": round(y, 4), "outline": np.round(hull / size, 4).tolist()}
