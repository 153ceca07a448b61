"""Recovering a recording of `lerobot-record` after a crash.

LeRobot's files can be read once it has closed them, so a crash leaves nothing readable. The session log holds every
state and action as they came. The actions are played again, exactly as the robot did, which yields the pictures; so
what `lerobot-record` would have left is written, episodes with restarts included.
"""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.configs.video import RGBEncoderConfig
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.complete.exchange import exchange, require_free, workspace
from lerobot_excav.datasets.complete.recovery_check import finished_episodes, recorded_features, require_one_kind
from lerobot_excav.datasets.complete.remains import Remains, read_remains
from lerobot_excav.datasets.complete.resimulation import STATE_TOLERANCE
from lerobot_excav.datasets.complete.session import SessionEpisode, read_session
from lerobot_excav.datasets.complete.session_events import ActionEvent, RestartEvent
from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.record.assembly import IMAGE_THREADS, VIDEO_ENCODER, without_progress_bars
from lerobot_excav.datasets.record.simulation import make_environment
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES, TaskSettings
from lerobot_excav.errors import DatasetError


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """What came of it.

    Attributes:
        root: The readable dataset.
        aside: Where the damaged files are now; None if they stayed where they were.
        episodes: How many episodes were recovered.
        lost: Number of the episode that was at work and is left out, if there was one.
        texts: Task texts that they were given.
    """

    root: Path
    aside: Path | None
    episodes: int
    lost: int | None
    texts: list[str]


def recover_recording(root: Path, session_path: Path, *, out: Path | None = None, task: str | None = None) -> Recovery:
    """Write every finished episode of a recording again, from its session.

    Args:
        root: The damaged dataset. Nothing in it is lost: its files are moved to a folder beside it.
        session_path: Session log of the simulated robot, with all sessions of the recording.
        out: Where to put the new dataset; by default it takes the place of the damaged one.
        task: Task text of episodes whose own cannot be read; by default the one that the session names, else the only
            one that the dataset holds, else the description of the task.

    Raises:
        DatasetError: The session does not fit the dataset, no episode was finished, or the states of the re-simulation
            are not those of the session. Then nothing is changed.
    """
    root, out = root.resolve(), out and out.absolute()
    require_free(out)
    remains, session = read_remains(root), read_session(session_path)
    finished = finished_episodes(session, remains)
    require_one_kind(finished, remains, session_path)
    spec = finished[0].spec
    texts = [remains.text_of(e.episode_index, task or e.session.task, spec.description) for e in finished]
    with workspace(beside=out or root) as folder:
        _write(folder / "recovered", finished, texts, remains)
        aside = None if out else _free_name(root)
        if aside is None:
            (folder / "recovered").rename(out or root)
        else:
            exchange(folder / "recovered", root, aside)
    left = sorted(session.keys() - {episode.episode_index for episode in finished})
    lost = left[0] if left else None
    return Recovery(root=out or root, aside=aside, episodes=len(finished), lost=lost, texts=list(dict.fromkeys(texts)))


def _write(root: Path, episodes: Sequence[SessionEpisode], texts: Sequence[str], remains: Remains) -> None:
    """Write a dataset as `lerobot-record` does."""
    storage, info = remains.storage, remains.video_info
    dataset = LeRobotDataset.create(
        repo_id=f"local/{remains.root.name}",
        root=root,
        fps=episodes[0].task_settings.fps,
        features=recorded_features(episodes[0], remains),
        robot_type=episodes[0].spec.robot_type,
        use_videos=storage == "video",
        rgb_encoder=RGBEncoderConfig.from_video_info(info) if info else RGBEncoderConfig(**VIDEO_ENCODER),
        image_writer_threads=IMAGE_THREADS,
        video_backend="pyav",
    )
    with ExitStack() as stack, without_progress_bars():
        envs: list[tuple[TaskSettings, MaskedTaskEnv[Any, Any]]] = []
        for episode, text in zip(episodes, texts, strict=True):
            settings = episode.task_settings
            if not envs or envs[-1][0] != settings:
                endless = settings.of({**settings.as_dict(), "episode_length": ENDLESS_FRAMES})
                env = stack.enter_context(closing(make_environment(endless, with_images=True)))
                envs.append((settings, env))
            for observation, frame in played_frames(envs[-1][1], episode):
                pictures = {schema.camera_key(name): picture for name, picture in observation["pixels"].items()}
                vectors = {schema.STATE_KEY: frame.state, schema.ACTION_KEY: frame.action}
                arrays = {key: np.array(values, np.float32) for key, values in vectors.items()}
                dataset.add_frame({"task": text, **arrays, **pictures})
            dataset.save_episode(parallel_encoding=False)  # processes would inherit the graphics context
        dataset.finalize()
    shutil.rmtree(root / "images", ignore_errors=True)  # the library's empty staging folders


def played_frames(
    env: MaskedTaskEnv[Any, Any], episode: SessionEpisode
) -> Iterator[tuple[dict[str, Any], ActionEvent | RestartEvent]]:
    """Play an episode again as the robot did; yield what is seen in each frame, and what was noted of it.

    Raises:
        DatasetError: A state deviates from the one noted.
    """
    number = 0
    for run in episode.runs:
        start = {"scene_id": run.scene_id, "stage": run.stage, "target_id": run.target_id}
        options = {**start, "commands": run.schedule}
        observation = env.reset(options=options)[0]
        for frame in run.frames:
            deviation = np.abs(observation["agent_pos"] - np.array(frame.state, np.float32)).max()
            if not deviation <= STATE_TOLERANCE:
                raise DatasetError(
                    f"{episode.place}: episode {episode.episode_index}, played again, leaves the state that was noted "
                    f"in frame {number} by {deviation:.3g} rad or rad/s (allowed {STATE_TOLERANCE:g}); was the session "
                    "log changed, or recorded on another kind of computer?"
                )
            yield observation, frame
            number += 1
            if isinstance(frame, ActionEvent):
                observation = env.step(np.array(frame.action, np.float32))[0]


def _free_name(root: Path) -> Path:
    """Return the name of a folder beside the dataset that does not exist yet."""
    number, path = 1, root.with_name(f"{root.name}.damaged")
    while path.exists() or path.is_symlink():
        number += 1
        path = root.with_name(f"{root.name}.damaged-{number}")
    return path
