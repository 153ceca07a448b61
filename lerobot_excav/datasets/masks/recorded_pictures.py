"""Masks for anybody's recordings: a picture is all there is, and words or a person say what to look for."""

from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.datasets.masks.found_masks import FoundMask
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.picture_view import PictureView
from lerobot_excav.envs.masks.source import MaskSource
from lerobot_excav.errors import DatasetError


def find_masks(view: PictureView, source: MaskSource, episode: int) -> list[FoundMask]:
    """Return the mask of an episode, the same in all of its frames.

    Raises:
        DatasetError: The source finds nothing.
    """
    mask = source.mask(view, Command(target_id=0, region=None))
    if mask is None or not mask.pixels.any():
        raise DatasetError(
            f"episode {episode}: the source finds nothing in its first picture; say otherwise what to look for, with "
            "--mask.text or --mask.options, or remove the episode with lerobot-edit-dataset"
        )
    return [FoundMask(frame=0, pixels=mask.pixels, parameters=mask.parameters)]


def first_pictures(root: Path, camera_key: str) -> Any:
    """Return a function from the number of an episode to its first picture, as a view.

    Raises:
        DatasetError: The dataset has no such camera.
    """
    from lerobot.datasets import LeRobotDataset

    dataset = LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")
    cameras = [key for key in dataset.meta.camera_keys if key not in dataset.meta.depth_keys]
    if camera_key not in cameras:
        raise DatasetError(f"--main_camera={camera_key} is no camera of {root}; allowed: {', '.join(cameras)}")

    def view(episode: int) -> PictureView:
        frame = dataset[int(dataset.meta.episodes[episode]["dataset_from_index"])]
        picture = (255.0 * frame[camera_key].permute(1, 2, 0).numpy()).round().astype(np.uint8)
        return PictureView(picture, key=f"episode/{episode}", words=str(frame["task"]), number=episode)

    return view
