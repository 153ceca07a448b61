"""Writing finished episodes as a LeRobot dataset, through its public interface."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import av.logging
import datasets as hf_datasets
import numpy as np
from lerobot.configs.video import RGBEncoderConfig
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode import Episode
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import TaskSettings

# Encoding a picture releases the interpreter lock; two threads hide most of it behind the rest (measured).
IMAGE_THREADS = 2

# Every second picture is a key frame: shorter files do not make up for more of them, and longer runs must be decoded to
# get at one picture (kind: measured, as is the codec: of the lossless ones read alike, it encodes fastest).
VIDEO_ENCODER = {"vcodec": "h264", "pix_fmt": "yuv444p", "crf": 0, "g": 2, "preset": "veryfast", "fast_decode": 1}
# Below the size of any episode, so that each has its own files: without torchcodec LeRobot opens a file for every
# picture, and that costs the more the longer the file is (measured: 3.5 ms with 400 pictures, 25 ms with 80 000).
VIDEO_FILE_SIZE_MB = 0.001


def create_dataset(root: Path, settings: DemonstrationSettings, *, longest: int | None = None) -> LeRobotDataset:
    """Create an empty dataset in a folder that does not exist yet.

    Args:
        root: The folder.
        settings: What is recorded.
        longest: Frames of the longest episode; that of the settings by default.
    """
    features = schema.dataset_features(
        settings.task_spec,
        height=settings.env.observation_height,
        width=settings.env.observation_width,
        storage=str(settings.storage),
    )
    return LeRobotDataset.create(
        repo_id=f"local/{root.name}",
        root=root,
        fps=settings.env.fps,
        features=features,
        robot_type=settings.task_spec.robot_type,
        video_backend="pyav",  # never used; looking for a better one prints a page where none is installed
        **_writer(settings, longest or settings.episode_length),
    )


def _writer(settings: DemonstrationSettings, longest: int) -> dict[str, Any]:
    """Return how LeRobot is to write the pictures of episodes with so many frames at most."""
    if settings.storage == "image":
        return {"use_videos": False, "image_writer_threads": IMAGE_THREADS}
    # LeRobot's encoders give libav's messages back to the terminal while others are at work.
    av.logging.set_libav_level(av.logging.ERROR)
    return {
        "use_videos": True,
        "rgb_encoder": RGBEncoderConfig(**VIDEO_ENCODER),
        "video_files_size_in_mb": VIDEO_FILE_SIZE_MB,
        "streaming_encoding": True,
        # A full queue would drop pictures, so it holds a whole episode.
        "encoder_queue_maxsize": longest + 1,
        "encoder_threads": 1,
    }


def constant_columns(episode: Episode, settings: TaskSettings, operator: str) -> dict[str, Any]:
    """Return the `excav.*` columns that are the same in every frame of an episode played with these settings.

    The operator is one of `OPERATORS`. Nobody took over, unless the frames say so.
    """
    return {
        schema.SCENE_KEY: episode.pair.scene_id,
        schema.STAGE_KEY: episode.pair.stage,
        schema.PAIR_KEY: episode.pair.uid,
        schema.OUTCOME_KEY: episode.outcome,
        schema.REST_KEY: episode.rest_frames,
        schema.SUCCESS_KEY: episode.success,
        schema.OPERATOR_KEY: operator,
        schema.INTERVENTION_KEY: False,
        schema.SIMULATION_KEY: task_of_settings(settings).simulation_version,
        schema.MASK_SOURCE_KEY: settings.mask_words,
        **{schema.setting_key(name): getattr(settings, name) for name in settings.columns()},
    }


def append_episode(dataset: LeRobotDataset, episode: Episode, settings: DemonstrationSettings) -> None:
    """Add an episode to a dataset that is being written."""
    constant = {
        key: value if isinstance(value, str | np.ndarray) else np.array([value])
        for key, value in constant_columns(episode, settings.env, episode.operator).items()
    }
    for frame in range(episode.length):
        varying = {
            schema.STATE_KEY: episode.state[frame],
            schema.ACTION_KEY: episode.action[frame],
            schema.TARGET_KEY: episode.target_id[frame : frame + 1],
            schema.COMMAND_KEY: episode.command_frame[frame : frame + 1],
            schema.TASK_STATE_KEY: episode.task_state[frame],
            schema.INTERVENTION_KEY: episode.intervention[frame : frame + 1],
        }
        images = {schema.camera_key(camera): frames[frame] for camera, frames in episode.images.items()}
        dataset.add_frame({"task": episode.task, **constant, **varying, **images})
    with without_progress_bars():
        dataset.save_episode()


def close_dataset(dataset: LeRobotDataset) -> None:
    """Complete the files of a dataset that all episodes were added to; from here on it can be read."""
    dataset.finalize()
    shutil.rmtree(Path(dataset.root) / "images", ignore_errors=True)  # the library's empty staging folders


@contextmanager
def without_progress_bars() -> Iterator[None]:
    """Keep the library's bar per episode out of the bar that counts the episodes."""
    enabled = not hf_datasets.are_progress_bars_disabled()
    hf_datasets.disable_progress_bars()
    try:
        yield
    finally:
        if enabled:
            hf_datasets.enable_progress_bars()
