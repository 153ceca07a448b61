"""Whether a recording of `lerobot-record` can be completed from its session."""

from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lerobot_excav.datasets.complete.session import SessionEpisode
from lerobot_excav.datasets.format.dataset_info import read_info
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.metadata import (
    missing_files,
    read_episode_metadata,
    read_statistics,
    read_tasks,
)
from lerobot_excav.datasets.format.schema import MASK_KEY, excav_features, require_columns
from lerobot_excav.datasets.format.version_check import require_this_simulation
from lerobot_excav.datasets.record.simulation import make_environment
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import DatasetError

MASK_OVERLAP = 0.8
"""Least intersection over union of recorded and drawn mask; another graphics card may draw its border differently, but
the patches of two targets lie apart (guess)."""


def require_readable(root: Path) -> None:
    """Check that LeRobot can open a recording: it asks the Hugging Face Hub for files that are missing.

    Raises:
        DatasetError: A file is missing or damaged, as after a crash.
    """
    try:
        info = read_info(root)
        episodes = read_episode_metadata(root, info)
        for problem in missing_files(root, info, episodes):
            raise DatasetError(problem)
        read_tasks(root, info)
        read_statistics(root)
        stored = [key for key in info.features if key not in info.keys_of("video")]
        for _ in iterate_episodes(root, stored):
            pass
    except DatasetError as damage:
        raise DatasetError(
            f"{damage}; after a crash of lerobot-record, add --recover to write its finished episodes again"
        ) from damage


def require_completable(root: Path, session: dict[int, SessionEpisode]) -> None:
    """Check that a recording lacks the `excav.*` columns only, and was made as its session says, in this simulation.

    Raises:
        DatasetError: It has them already, lacks others, or was made otherwise.
    """
    info = read_info(root)
    spec = info.spec
    added = excav_features(spec)
    present = [key for key in added if key in info.features]
    if present:
        raise DatasetError(
            f"{root} has {', '.join(present)} already; run `lerobot-excav index {root}` without --session"
        )
    require_columns(spec, info.features | added)
    missing = [index for index in range(info.total_episodes) if index not in session]
    if missing:
        raise DatasetError(f"the session has no line for episodes {missing}; is it the session of this recording?")
    versions = {index: session[index].simulation_version for index in range(info.total_episodes)}
    require_this_simulation(spec, versions, source=root, instead="")
    for index in range(info.total_episodes):
        episode = session[index]
        if episode.env != spec.env_type:
            raise DatasetError(
                f"episode {index}: the session is of {episode.env}, the recording of {spec.env_type}; "
                "is it the session of this recording?"
            )
        fps = episode.task_settings.fps
        if fps != info.fps:
            raise DatasetError(
                f"episode {index}: the robot ran at {fps} frames/s, the dataset has {info.fps}; "
                "record with --robot.fps equal to --dataset.fps"
            )


def require_operator(session: dict[int, SessionEpisode], operator: str) -> None:
    """Check that a session does not say that somebody else commanded.

    Raises:
        DatasetError: It does.
    """
    named = {index: episode.operator for index, episode in session.items() if episode.operator not in (None, operator)}
    if named:
        others = "; ".join(f"episode {index}: {name}" for index, name in named.items())
        raise DatasetError(
            f"--operator={operator}, but the session says who commanded ({others}); leave the option out: it is for "
            "episodes of which the session says nothing"
        )


def whole_episodes(session: dict[int, SessionEpisode], total: int, *, skip_restarted: bool) -> list[int]:
    """Return the episodes of a recording in which the scene was not restarted and no mask was waited for.

    Raises:
        DatasetError: There are others that may not be left out, or nothing else.
    """
    whole = [index for index in range(total) if not session[index].restarts]
    if len(whole) < total and not (skip_restarted and whole):
        restarts = {index: session[index].restarts for index in range(total) if session[index].restarts}
        places = "; ".join(f"episode {index} at frame {list(frames)}" for index, frames in restarts.items())
        raise DatasetError(
            f"the scene was restarted, or the machine waited for its mask, within {places}, so actions alone do not "
            "lead from its start to its end; leave such episodes out "
            "with --skip_restarted, if others remain, or record again (lerobot-record re-records an episode with the "
            "left arrow key, or r)"
        )
    return whole


def require_recorded_targets(root: Path, session: dict[int, SessionEpisode]) -> None:
    """Check that every episode has the length and the first mask that its line of the session announces.

    Masks of later commands depend on what has happened by then; they are checked with the states.

    Raises:
        DatasetError: One has not.
    """
    hint = "was the dataset edited after recording? Index first, edit afterwards"
    with ExitStack() as stack:
        envs: list[tuple[TaskSettings, MaskedTaskEnv[Any, Any]]] = []
        for recorded in iterate_episodes(root, (MASK_KEY,)):
            episode = session[recorded.index]
            if episode.frames != recorded.length:
                raise DatasetError(
                    f"episode {recorded.index} has {recorded.length} frames, but the session noted "
                    f"{episode.frames} for {episode.pair.uid}; {hint}"
                )
            settings = episode.task_settings
            # All episodes of a session share their settings, and a graphics context is slow to open.
            if not envs or envs[-1][0] != settings:
                env = stack.enter_context(closing(make_environment(settings, with_images=True)))
                envs.append((settings, env))
            observation, _ = envs[-1][1].reset(options=dict(episode.pair.reset_options))
            if not _same_mask(recorded.image(MASK_KEY, 0), observation["pixels"]["target_mask"]):
                raise DatasetError(
                    f"episode {recorded.index} does not show the target mask of {episode.pair.uid}, "
                    f"which the session names; {hint}"
                )


def _same_mask(recorded_img: NDArray[Any], drawn_img: NDArray[Any]) -> bool:
    """Compare two masks (H, W, 3), binarised at mid-grey."""
    if recorded_img.shape != drawn_img.shape:
        return False
    recorded, drawn = recorded_img[..., 0] > 127, drawn_img[..., 0] > 127
    return bool((recorded & drawn).sum() >= MASK_OVERLAP * (recorded | drawn).sum())
