"""Checks of one recorded episode that need no simulation."""

from collections.abc import Iterator

import numpy as np

from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.format.schema import MASK_KEY, STATE_KEY, TASK_STATE_KEY, camera_key

MAIN_KEY = camera_key("main")

FIRST_IMAGE_TOLERANCE = 2
"""Grey levels by which the first pictures of a scene may differ; graphics cards round differently (guess)."""


ACTION_MARGIN = 0.1
"""Share of its range by which an action may lie outside of it: `lerobot-rollout` records what the policy asked for, and
environments clip it. More speaks of another unit (guess)."""


def episode_problems(episode: EpisodeTable) -> list[str]:
    """Describe what is wrong with an episode.

    Args:
        episode: The episode with all columns of the index, and its frame numbers.

    Returns:
        Problems, in plain words; empty if there is none.
    """
    return [*_number_problems(episode), *_mask_problems(episode)]


def _number_problems(episode: EpisodeTable) -> Iterator[str]:
    frames = episode.array("frame_index")
    if not np.array_equal(frames, np.arange(episode.length)):
        yield f"frames are not numbered 0 to {episode.length - 1}"
    for name, values in (
        (STATE_KEY, episode.state),
        ("action", episode.action),
        (TASK_STATE_KEY, episode.task_state),
    ):
        if not np.isfinite(values).all():
            yield f"{name} is not finite at frame {int(np.argmin(np.isfinite(values).all(axis=1)))}"
    names = episode.environment.action_names
    for name, values, low, high in zip(
        names, episode.action.T, *episode.environment.action_limits, strict=True
    ):
        margin = ACTION_MARGIN * (high - low)
        outside = values[(values < low - margin) | (values > high + margin)]
        if outside.size:
            worst = outside[np.argmax(np.abs(outside))]
            yield f"action {name} reaches {worst:.3g}; allowed are {low:.3g} to {high:.3g}"


def _mask_problems(episode: EpisodeTable) -> Iterator[str]:
    if episode.distinct_images(MASK_KEY) != 1:
        yield "the target mask changes within the episode"
    mask_img = episode.image(MASK_KEY, 0)
    if not np.isin(mask_img, (0, 255)).all():
        yield f"the target mask is not binary: it holds {np.unique(mask_img)[:4].tolist()}; allowed are 0 and 255"
    elif not mask_img.any():
        yield "the target mask is empty"


def scene_problems(episodes: list[EpisodeTable]) -> dict[int, str]:
    """Compare the starts of the episodes of one scene.

    Args:
        episodes: Episodes with state, main view and mask.

    Returns:
        Problems by episode index: another initial state or view than the scene's first episode, or the mask of
        another target.
    """
    problems = {}
    reference = episodes[0]
    masks: dict[bytes, int] = {}
    for episode in episodes:
        difference = episode.image(MAIN_KEY, 0).astype(int) - reference.image(MAIN_KEY, 0).astype(int)
        target = episode.pair.target_id
        shown = masks.setdefault(episode.image(MASK_KEY, 0).tobytes(), target)
        if not np.array_equal(episode.state[0], reference.state[0]):
            problems[episode.index] = (
                f"starts in another state than episode {reference.index} of the same scene"
            )
        elif np.abs(difference).max() > FIRST_IMAGE_TOLERANCE:
            problems[episode.index] = (
                f"starts with another view than episode {reference.index} of the same scene"
            )
        elif shown != target:
            problems[episode.index] = f"target {target} has the mask of target {shown}"
    return problems
