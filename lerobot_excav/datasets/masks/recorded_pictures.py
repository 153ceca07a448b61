"""Masks for anybody's recordings: a picture is all there is, and words or a person say what to look for."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.masks.found_masks import FoundMask
from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import MaskSource, Pixels
from lerobot_excav.errors import ConfigurationError, DatasetError


class RecordedPicture:
    """The first picture of an episode, as a view for mask sources.

    Args:
        picture: (H, W, 3) uint8.
        episode: Its number, which files of masks name as `episode/NUMBER`.
        task: What was to be done, in words.
    """

    def __init__(self, picture: NDArray[np.uint8], episode: int, task: str) -> None:
        self._picture, self._episode, self._task = picture, episode, task

    @property
    def camera(self) -> PinholeCamera:
        """A camera of the picture's size; where it stood is not known."""
        height, width = self._picture.shape[:2]
        return PinholeCamera(position_w=np.zeros(3), axes_w=np.eye(3), fovy_rad=1.0, height=height, width=width)

    @property
    def scene_key(self) -> tuple[int, ...]:
        """The number of the episode."""
        return (self._episode,)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture."""
        return self._picture.copy()

    def depth_m(self) -> NDArray[np.float32]:
        """Refuse: nothing was measured.

        Raises:
            ConfigurationError: Always.
        """
        raise ConfigurationError("this dataset has no depth; use a mask source that needs none")

    def shot(self) -> Shot:
        """Return the picture, without depth."""
        return Shot(picture=self._picture)

    def command_key(self, command: Command) -> str:
        """Return `episode/NUMBER`."""
        return f"episode/{self._episode}"

    def place_w(self, command: Command) -> None:
        """Nobody has said where the target was."""

    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> None:
        """Targets are objects."""

    def words(self, command: Command) -> str:
        """Return what was to be done."""
        return self._task

    def other_commands(self) -> list[Command]:
        """Return none: nobody knows what else there was."""
        return []

    def true_mask(self, command: Command) -> Pixels:
        """Refuse: there is no simulator.

        Raises:
            ConfigurationError: Always.
        """
        raise ConfigurationError("the source 'oracle' asks a simulator, and this dataset was not recorded in one")


def find_masks(view: RecordedPicture, source: MaskSource, episode: int) -> list[FoundMask]:
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
    """Return a function from the number of an episode to its `RecordedPicture`.

    Raises:
        DatasetError: The dataset has no such camera.
    """
    from lerobot.datasets import LeRobotDataset

    dataset = LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")
    cameras = dataset.meta.camera_keys
    if camera_key not in cameras:
        raise DatasetError(f"--main_camera={camera_key} is no camera of {root}; allowed: {', '.join(cameras)}")

    def view(episode: int) -> RecordedPicture:
        frame = dataset[int(dataset.meta.episodes[episode]["dataset_from_index"])]
        picture = (255.0 * frame[camera_key].permute(1, 2, 0).numpy()).round().astype(np.uint8)
        return RecordedPicture(picture, episode, str(frame["task"]))

    return view
