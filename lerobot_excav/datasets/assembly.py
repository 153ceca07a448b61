"""Writing finished episodes as a LeRobot dataset, through its public interface."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import datasets as hf_datasets
import numpy as np
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.episode import Episode
from lerobot_excav.datasets.schema import (
    ACTION_KEY,
    FIDELITY_KEY,
    PAIR_KEY,
    ROBOT_TYPE,
    SCENE_KEY,
    SIMULATION_KEY,
    SOIL_KEY,
    STATE_KEY,
    SUCCESS_KEY,
    TARGET_KEY,
    TASK_STATE_KEY,
    camera_key,
    dataset_features,
)
from lerobot_excav.envs.simulation_version import SIMULATION_VERSION

# Encoding a picture releases the interpreter lock; two threads hide most of it behind the rest (measured).
IMAGE_THREADS = 2


def create_dataset(root: Path, *, fps: int, height: int, width: int) -> LeRobotDataset:
    """Create an empty excavator dataset.

    Args:
        root: Its folder; must not exist.
        fps: Frames per second.
        height: Image height [px].
        width: Image width [px].
    """
    return LeRobotDataset.create(
        repo_id=f"local/{root.name}",
        root=root,
        fps=fps,
        features=dataset_features(height=height, width=width),
        robot_type=ROBOT_TYPE,
        use_videos=False,
        video_backend="pyav",  # never used; looking for a better one prints a page where none is installed
        image_writer_threads=IMAGE_THREADS,
    )


def append_episode(dataset: LeRobotDataset, episode: Episode, settings: DemonstrationSettings) -> None:
    """Add an episode to a dataset that is being written.

    Args:
        dataset: The dataset.
        episode: The episode.
        settings: What it was played with.
    """
    constant = {
        SCENE_KEY: np.array([episode.pair.scene_id], dtype=np.int64),
        TARGET_KEY: np.array([episode.pair.target_id], dtype=np.int64),
        PAIR_KEY: episode.pair.uid,
        SUCCESS_KEY: np.array([episode.success]),
        SIMULATION_KEY: np.array([SIMULATION_VERSION], dtype=np.int64),
        SOIL_KEY: settings.soil,
        FIDELITY_KEY: settings.fidelity,
        "task": episode.task,
    }
    for frame in range(episode.length):
        varying = {
            STATE_KEY: episode.state[frame],
            ACTION_KEY: episode.action[frame],
            TASK_STATE_KEY: episode.task_state[frame],
        }
        images = {camera_key(camera): frames[frame] for camera, frames in episode.images.items()}
        dataset.add_frame({**constant, **varying, **images})
    with _without_progress_bars():
        dataset.save_episode()


@contextmanager
def _without_progress_bars() -> Iterator[None]:
    """Keep the library's bar per episode out of the bar that counts the episodes."""
    enabled = not hf_datasets.are_progress_bars_disabled()
    hf_datasets.disable_progress_bars()
    try:
        yield
    finally:
        if enabled:
            hf_datasets.enable_progress_bars()
