"""Completing a recording of `lerobot-record` with the columns that only the simulation knows.

The recorder stores pictures, state and action. The actions are played again from the scene that the session log names;
if the recorded states come out, so do the task state and the outcome of the original. All targets of a scene start from
the same state, so states cannot tell them apart: the target is known by its mask.
"""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.datasets import LeRobotDataset, add_features, delete_episodes

from lerobot_excav.datasets.complete.exchange import copy_foreign_files, exchange, require_free, workspace
from lerobot_excav.datasets.complete.recording_check import (
    require_completable,
    require_operator,
    require_readable,
    require_recorded_targets,
    whole_episodes,
)
from lerobot_excav.datasets.complete.session import SessionEpisode, read_session
from lerobot_excav.datasets.complete.statistics import write_statistics
from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.format.dataset_info import read_info
from lerobot_excav.datasets.format.episode_table import EpisodeTable, iterate_episodes
from lerobot_excav.datasets.pairs.paired_index import write_index
from lerobot_excav.datasets.record.assembly import constant_columns
from lerobot_excav.datasets.record.episode import Episode
from lerobot_excav.datasets.record.simulation import play_again
from lerobot_excav.errors import DatasetError

STATE_TOLERANCE = 1e-4
"""Allowed deviation of a state [rad, rad/s]; the same build repeats exactly, another processor may round (guess)."""


def complete_recording(
    root: Path,
    session_path: Path,
    *,
    out: Path | None = None,
    skip_restarted: bool = False,
    operator: str | None = None,
) -> Path:
    """Add the `excav.*` columns to a recording, and its index.

    Args:
        root: The recorded dataset. It stays as it is until everything has succeeded.
        session_path: Session log of the simulated robot.
        out: Where to put the completed dataset; it replaces `root` by default.
        skip_restarted: Whether to leave out episodes in which the scene was restarted, instead of refusing them.
        operator: Who commanded, one of `schema.OPERATORS`; by default a person, or whom the session names.

    Returns:
        Folder of the completed dataset.

    Raises:
        DatasetError: A file is damaged, columns exist already, the session does not fit, or the re-simulation deviates
            from the recording.
    """
    # A link to a dataset stays a link, and the data is completed where it lies.
    root, out = root.resolve(), out and out.absolute()
    require_free(out)
    session = read_session(session_path)
    require_readable(root)
    require_completable(root, session)
    if operator is not None:
        require_operator(session, operator)
    whole = whole_episodes(session, read_info(root).total_episodes, skip_restarted=skip_restarted)
    with workspace(beside=out or root) as folder:
        completed = folder / "completed"
        reduced = _reduced(root, whole, folder / "whole")
        # Leaving episodes out renumbers the others.
        renumbered = {number: session[index] for number, index in enumerate(whole)}
        require_recorded_targets(reduced, renumbered)
        episodes = _resimulate_all(reduced, renumbered)
        _write_completed(reduced, episodes, renumbered, completed, operator or "person")
        write_statistics(completed, schema.excav_features(read_info(completed).spec))
        write_index(completed)
        if out is not None:
            return completed.rename(out)
        copy_foreign_files(root, completed)
        # Not within the folder that is removed whatever happens.
        original = folder.with_name(f"{folder.name}.original")
        exchange(completed, root, original)
        shutil.rmtree(original)
        return root


def _reduced(root: Path, episodes: list[int], copy: Path) -> Path:
    """Return a dataset with these episodes only, by LeRobot's own tool: `root` if it has no others, else a copy."""
    others = sorted(set(range(read_info(root).total_episodes)) - set(episodes))
    if not others:
        return root
    dataset = LeRobotDataset(repo_id=f"local/{root.name}", root=root, video_backend="pyav")
    delete_episodes(dataset, others, output_dir=copy, repo_id=dataset.repo_id)
    return copy


def _resimulate_all(root: Path, session: dict[int, SessionEpisode]) -> dict[int, Episode]:
    return {
        recorded.index: _resimulate(recorded, session[recorded.index])
        for recorded in iterate_episodes(root, (schema.STATE_KEY, schema.ACTION_KEY))
    }


def _resimulate(recorded: EpisodeTable, session: SessionEpisode) -> Episode:
    settings = session.task_settings
    noted = np.array([frame.action for frame in session.runs[0].frames], dtype=np.float32)
    if not np.array_equal(noted, recorded.action):
        frame = int(np.argmax((noted != recorded.action).any(axis=1)))
        raise DatasetError(
            f"episode {recorded.index}: {session.place} and the recording have different actions in frame {frame}; is "
            "it the session of this recording?"
        )
    columns = {name: getattr(settings, name) for name in settings.columns()}
    played = play_again(
        session.spec, recorded.action, session.pair, session.schedule, fps=settings.fps, columns=columns
    )
    largest, frame = state_deviation(played, recorded)
    if largest > STATE_TOLERANCE:
        raise DatasetError(
            f"episode {recorded.index}: the re-simulation of {session.pair.uid} leaves the recorded state at frame "
            f"{frame} of {recorded.length} (largest deviation {largest:.3g} rad or rad/s, allowed "
            f"{STATE_TOLERANCE:g}); is it the session of this recording, and the version that recorded it?"
        )
    return played


def state_deviation(played: Episode, recorded: EpisodeTable) -> tuple[float, int]:
    """Return by how much states differ at most [rad, rad/s], and the first frame where they differ too much, or 0."""
    deviation = np.abs(played.state - recorded.state).max(axis=1)
    return float(deviation.max()), int(np.argmax(deviation > STATE_TOLERANCE))


def _write_completed(
    root: Path, episodes: dict[int, Episode], session: dict[int, SessionEpisode], out: Path, operator: str
) -> None:
    """Copy a dataset with the new columns, by LeRobot's own tool; the operator is that of whom the log says nothing."""
    constant = {
        i: constant_columns(episode, session[i].task_settings, session[i].operator or operator)
        for i, episode in episodes.items()
    }
    varying = {
        schema.TARGET_KEY: "target_id",
        schema.COMMAND_KEY: "command_frame",
        schema.TASK_STATE_KEY: "task_state",
    }

    def value(key: str) -> Callable[[Any, Any, Any], Any]:
        if key in varying:
            return lambda row, episode, frame: getattr(episodes[int(episode)], varying[key])[int(frame)]
        return lambda row, episode, frame: constant[int(episode)][key]

    columns = schema.excav_features(read_info(root).spec)
    features = {key: (value(key), feature) for key, feature in columns.items()}
    dataset = LeRobotDataset(repo_id=f"local/{root.name}", root=root, video_backend="pyav")
    add_features(dataset, features, output_dir=out, repo_id=dataset.repo_id)
