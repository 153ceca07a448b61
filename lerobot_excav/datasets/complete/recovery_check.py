"""Which episodes of a recording can be recovered from its session, and whether they belong together."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.complete.remains import Remains
from lerobot_excav.datasets.complete.session import SessionEpisode
from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.format.version_check import require_this_simulation
from lerobot_excav.errors import DatasetError


def finished_episodes(session: dict[int, SessionEpisode], remains: Remains) -> list[SessionEpisode]:
    """Return the episodes that were recorded to their end, in order.

    All before the last one of the session were, for LeRobot counts on from what it has saved. The last one was, if its
    end was announced, or if the dataset counts it.

    Raises:
        DatasetError: The session lacks an episode, or none was finished.
    """
    saved = None if remains.info is None else remains.info.total_episodes
    last = max(session, default=-1)
    missing = [index for index in range(max(last + 1, saved or 0)) if index not in session]
    if missing:
        raise DatasetError(
            f"the session has nothing of episodes {missing} of {remains.root}; is it the session of this recording? If "
            "it was recorded in several sessions with a log each, join these, in their order, with `cat`"
        )
    finished = [session[index] for index in range(last + 1)]
    if finished and not _is_finished(finished[-1], saved):
        finished.pop()
    if not finished:
        raise DatasetError(
            f"no episode of {remains.root} was finished, so there is nothing to recover; remove it and record again"
        )
    return finished


def _is_finished(episode: SessionEpisode, saved: int | None) -> bool:
    if not any(run.frames for run in episode.runs):
        return False
    is_saved = episode.end == "stopped" if saved is None else episode.episode_index < saved
    return is_saved or episode.end == "ended"


def require_one_kind(episodes: Sequence[SessionEpisode], remains: Remains, session_path: Path) -> None:
    """Check that this simulation recorded the episodes, all with the same columns, which are those of the dataset.

    Raises:
        DatasetError: It did not, or they differ.
    """
    spec, fps, features = episodes[0].spec, episodes[0].task_settings.fps, recorded_features(episodes[0], remains)
    versions = {episode.episode_index: episode.simulation_version for episode in episodes}
    require_this_simulation(spec, versions, source=session_path, instead="")
    for episode in episodes:
        if (episode.task_settings.fps, recorded_features(episode, remains)) != (fps, features):
            raise DatasetError(
                f"{episode.place}: episode {episode.episode_index} has another robot, frame rate or size of pictures "
                f"than episode {episodes[0].episode_index}; is it the session of one recording?"
            )
    info = remains.info
    if info is None:
        return
    recorded = {key: _essence(feature) for key, feature in info.features.items() if key in features or "." in key}
    expected = {key: _essence(feature) for key, feature in features.items()}
    if (info.fps, info.robot_type, recorded) != (fps, spec.robot_type, expected):
        differing = sorted(key for key in recorded.keys() | expected if recorded.get(key) != expected.get(key))
        raise DatasetError(
            f"{remains.root} is of robot_type={info.robot_type!r} with {info.fps} frames/s, the session of "
            f"{spec.robot_type!r} with {fps}{f'; other columns: {differing}' if differing else ''}; is it the session "
            "of this recording, as lerobot-record left it?"
        )


def recorded_features(episode: SessionEpisode, remains: Remains) -> dict[str, schema.Feature]:
    """Describe the columns that `lerobot-record` makes of an episode."""
    height, width = episode.task_settings.observation_size
    features = schema.dataset_features(episode.spec, height=height, width=width, storage=remains.storage)
    return {key: feature for key, feature in features.items() if key not in schema.excav_features(episode.spec)}


def _essence(feature: schema.Feature) -> tuple[Any, ...]:
    return feature["dtype"], feature["shape"], feature["names"]
