"""Completing a recording of `lerobot-record` with the columns that only the simulation knows.

The recorder stores pictures, state and action. The actions are played again from the scene that the session log names;
if the recorded states come out, so do the task state and the outcome of the original. All targets of a scene start from
the same state, so states cannot tell them apart: the target is known by its mask.
"""

import functools
import shutil
import uuid
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.datasets import LeRobotDataset, add_features
from numpy.typing import NDArray

from lerobot_excav.datasets.episode import Episode, replay
from lerobot_excav.datasets.episode_table import EpisodeTable, iterate_episodes, read_info
from lerobot_excav.datasets.paired_index import write_index
from lerobot_excav.datasets.rig import ExcavatorRig, Rig
from lerobot_excav.datasets.schema import (
    ACTION_KEY,
    MASK_KEY,
    PAIR_KEY,
    SCENE_KEY,
    SIMULATION_KEY,
    STATE_KEY,
    SUCCESS_KEY,
    TARGET_KEY,
    TASK_STATE_KEY,
    excav_features,
    require_columns,
)
from lerobot_excav.datasets.session import SESSION_PATH, SessionEpisode, read_session
from lerobot_excav.datasets.version_check import require_this_simulation
from lerobot_excav.envs.simulation_version import SIMULATION_VERSION
from lerobot_excav.errors import DatasetError

STATE_TOLERANCE = 1e-4
"""Allowed deviation of a state [rad, rad/s]; the same build repeats exactly, another processor may round (guess)."""

MASK_OVERLAP = 0.8
"""Least intersection over union of recorded and drawn mask; another graphics card may draw its border differently, but
the patches of two targets lie apart (guess)."""


def complete_recording(
    root: Path, session_path: Path, *, out: Path | None = None, rig: Rig | None = None
) -> Path:
    """Add the `excav.*` columns to a recording, and its index.

    Args:
        root: The recorded dataset. It stays as it is until everything has succeeded.
        session_path: Session log of the simulated robot.
        out: Where to put the completed dataset; it replaces `root` by default.
        rig: Makes the environment; the excavator by default.

    Returns:
        Folder of the completed dataset.

    Raises:
        DatasetError: Columns exist already, the session does not fit, or the re-simulation deviates from the recording.
    """
    if out is not None and out.exists():
        raise DatasetError(f"--out={out} exists; choose another folder, or remove it first")
    session = read_session(session_path)
    _require_completable(root, session)
    _require_recorded_targets(root, session, rig or ExcavatorRig())
    rig = rig or ExcavatorRig(with_images=False)
    episodes = {
        recorded.index: _resimulate(rig, recorded, session[recorded.index])
        for recorded in iterate_episodes(root, (STATE_KEY, ACTION_KEY))
    }
    # Beside the destination, so that the last step is a rename.
    temporary = (out or root).with_name(f".{root.name}.{uuid.uuid4().hex[:8]}")
    try:
        _write_completed(root, episodes, temporary)
        shutil.copyfile(session_path, temporary / SESSION_PATH)
        write_index(temporary)
        return _put_in_place(temporary, root, out)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _require_completable(root: Path, session: dict[int, SessionEpisode]) -> None:
    info = read_info(root)
    present = [key for key in excav_features() if key in info.features]
    if present:
        raise DatasetError(
            f"{root} has {', '.join(present)} already; run `lerobot-excav index {root}` without --session"
        )
    require_columns(info.features | excav_features())
    missing = [index for index in range(info.total_episodes) if index not in session]
    if missing:
        raise DatasetError(
            f"the session has no line for episodes {missing}; is it the session of this recording?"
        )
    versions = {index: session[index].simulation_version for index in range(info.total_episodes)}
    require_this_simulation(versions, source=root, instead="")
    for index in range(info.total_episodes):
        episode = session[index]
        if episode.fps != info.fps:
            raise DatasetError(
                f"episode {index}: the robot ran at {episode.fps} frames/s, the dataset has {info.fps}; "
                "record with --robot.fps equal to --dataset.fps"
            )
        if episode.restarts:
            raise DatasetError(
                f"episode {index} was restarted at frame {list(episode.restarts)}, so it is no single demonstration; "
                "record it again (lerobot-record offers re-recording with the left arrow key, or r)"
            )


def _require_recorded_targets(root: Path, session: dict[int, SessionEpisode], rig: Rig) -> None:
    """Check that every episode has the length and the mask that its line of the session announces."""
    hint = "was the dataset edited after recording? Index first, edit afterwards"
    with ExitStack() as stack:
        # All episodes of a session share their settings, and a graphics context is slow to open.
        environment = functools.cache(
            lambda settings: stack.enter_context(closing(rig.environment(settings)))
        )
        for recorded in iterate_episodes(root, (MASK_KEY,)):
            episode = session[recorded.index]
            if episode.frames not in (None, recorded.length):
                raise DatasetError(
                    f"episode {recorded.index} has {recorded.length} frames, but the session noted "
                    f"{episode.frames} for {episode.pair.uid}; {hint}"
                )
            options = {"scene_id": episode.scene_id, "target_id": episode.target_id}
            observation, _ = environment(episode.settings()).reset(options=options)
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
    return bool((recorded & drawn).sum() >= MASK_OVERLAP * max((recorded | drawn).sum(), 1))


def _resimulate(rig: Rig, recorded: EpisodeTable, session: SessionEpisode) -> Episode:
    env = rig.environment(session.settings())
    try:
        played = replay(env, recorded.action, session.pair)
    finally:
        env.close()
    deviation = np.abs(played.state - recorded.state).max(axis=1)
    if deviation.max() > STATE_TOLERANCE:
        frame = int(np.argmax(deviation > STATE_TOLERANCE))
        raise DatasetError(
            f"episode {recorded.index}: the re-simulation of {session.pair.uid} leaves the recorded state at frame "
            f"{frame} of {recorded.length} (largest deviation {deviation.max():.3g} rad or rad/s, allowed "
            f"{STATE_TOLERANCE:g}); is it the session of this recording, and the version that recorded it?"
        )
    return played


def _write_completed(root: Path, episodes: dict[int, Episode], out: Path) -> None:
    """Copy a dataset with the new columns, by LeRobot's own tool."""

    def constant(key: str, values: dict[int, Any]) -> tuple[Any, dict[str, Any]]:
        return lambda row, episode, frame: values[int(episode)], excav_features()[key]

    def task_state(row: dict[str, Any], episode: int, frame: int) -> NDArray[Any]:
        values: NDArray[Any] = episodes[int(episode)].task_state[int(frame)]
        return values

    features = {
        SCENE_KEY: constant(SCENE_KEY, {i: e.pair.scene_id for i, e in episodes.items()}),
        TARGET_KEY: constant(TARGET_KEY, {i: e.pair.target_id for i, e in episodes.items()}),
        PAIR_KEY: constant(PAIR_KEY, {i: e.pair.uid for i, e in episodes.items()}),
        TASK_STATE_KEY: (task_state, excav_features()[TASK_STATE_KEY]),
        SUCCESS_KEY: constant(SUCCESS_KEY, {i: e.success for i, e in episodes.items()}),
        SIMULATION_KEY: constant(SIMULATION_KEY, dict.fromkeys(episodes, SIMULATION_VERSION)),
    }
    dataset = LeRobotDataset(repo_id=f"local/{root.name}", root=root, video_backend="pyav")
    add_features(dataset, features, output_dir=out, repo_id=dataset.repo_id)


def _put_in_place(temporary: Path, root: Path, out: Path | None) -> Path:
    if out is not None:
        temporary.rename(out)
        return out
    original = temporary.with_name(f"{temporary.name}.original")
    root.rename(original)
    try:
        temporary.rename(root)
    except OSError:
        original.rename(root)
        raise
    shutil.rmtree(original)
    return root
