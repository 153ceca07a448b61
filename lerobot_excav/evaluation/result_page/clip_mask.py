"""The masks that an episode was shown, drawn again from its scene and its commands."""

from contextlib import closing
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.measures import MASK_SETTINGS, EpisodeKey
from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.evaluation.run import Run


class ShownMask(NamedTuple):
    """A mask, bool (H, W), and the frame from which it was shown."""

    since: int
    pixels: NDArray[np.bool_]


def shown_masks(run: Run, key: EpisodeKey, *, height: int, width: int) -> list[ShownMask]:
    """Draw the masks of an episode for pictures of a size [px], in the order in which they were shown.

    After a change of the command the mask is that of the new target as the scene was at the start.

    Raises:
        RenderingError: Pictures cannot be made on this machine.
    """
    shown = {name: run.constants[name] for name in (*MASK_SETTINGS, *run.measures.settings)}
    size = {"observation_height": height, "observation_width": width}
    commands = run.first.episodes[key].commands
    with closing(task_spec("task", run.task).make_env(scene_set=key.scene_set, **size, **shown)) as env:
        return [ShownMask(since=frame, pixels=_mask(env, key.scene_id, target_id)) for frame, target_id in commands]


def _mask(env: Any, scene_id: int, target_id: int) -> NDArray[np.bool_]:
    observation, _ = env.reset(options={"scene_id": scene_id, "target_id": target_id})
    return np.asarray(observation["pixels"]["target_mask"][..., 0] > 127)
