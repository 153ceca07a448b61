"""Masks for demonstrations of this package: the simulator shows their starts again, depth included."""

from contextlib import closing
from typing import Any

from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.format.schema import (
    ACTION_KEY,
    COMMAND_KEY,
    MASK_SOURCE_KEY,
    PAIR_KEY,
    REST_KEY,
    SCENE_KEY,
    STAGE_KEY,
    TARGET_KEY,
    setting_key,
)
from lerobot_excav.datasets.masks.found_masks import FoundMask
from lerobot_excav.envs.masks.source import MaskSource
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError


def needed_keys(spec: TaskSpec) -> list[str]:
    """Return the columns that say how an episode began and what was done in it."""
    settings = [setting_key(name) for name in spec.settings.columns()]
    start = [PAIR_KEY, SCENE_KEY, STAGE_KEY, TARGET_KEY, COMMAND_KEY]
    return [ACTION_KEY, REST_KEY, MASK_SOURCE_KEY, *start, *settings]


def find_masks(recorded: EpisodeTable, source: MaskSource, *, fps: int, size: tuple[int, int]) -> list[FoundMask]:
    """Return the masks of all commands of an episode, in the size (H, W) of its pictures.

    Raises:
        DatasetError: The source finds nothing for a command, or the old mask is tinted into the pictures.
    """
    spec = recorded.spec
    require_untinted(recorded)
    length = spec.replay_length(recorded.length + recorded.rest_frames)
    settings = {"scene_set": recorded.pair.scene_set, "fps": fps, "episode_length": length, **recorded.settings}
    env = spec.make_env(
        obs_type="agent_pos", render_mode=None, observation_height=size[0], observation_width=size[1], **settings
    )
    with closing(env):
        env.reset(options={**recorded.pair.reset_options, "commands": recorded.schedule})
        masks = [_mask(env, source, recorded, frame=0)]
        changes = [frame for frame, _ in recorded.schedule]
        for frame, action in enumerate(recorded.action[: max(changes, default=0)], start=1):
            env.step(action)
            if frame in changes:
                masks.append(_mask(env, source, recorded, frame=frame))
    return masks


def require_untinted(recorded: EpisodeTable) -> None:
    """Check that the pictures themselves show no target.

    Raises:
        DatasetError: They do: another mask would contradict them.
    """
    if "as overlay" in recorded.mask_changes:
        raise DatasetError(
            f"episode {recorded.index}: the old mask is tinted into its pictures (target_overlay), and another one "
            "would contradict it; record it again without the overlay"
        )


def _mask(env: MaskedTaskEnv[Any, Any], source: MaskSource, recorded: EpisodeTable, *, frame: int) -> FoundMask:
    mask = source.mask(env, env.command)
    if mask is None or not mask.pixels.any():
        raise DatasetError(
            f"episode {recorded.index}: the source finds nothing for the command of frame {frame}, and a policy would "
            "learn to act without a target; remove the episode with lerobot-edit-dataset, or take another source"
        )
    return FoundMask(frame=frame, pixels=mask.pixels, parameters=mask.parameters)
