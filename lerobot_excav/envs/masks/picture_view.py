"""A view for mask sources where a picture is all there is: of a recording, or of a robot's camera."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.shot import Shot
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.errors import ConfigurationError


class PictureView:
    """A picture, as a view for mask sources.

    Args:
        picture: (H, W, 3) uint8.
        key: By which files of masks name it.
        words: What people say of the target.
        number: Tells one picture from another.
    """

    def __init__(self, picture: NDArray[np.uint8], *, key: str, words: str, number: int = 0) -> None:
        self._picture, self._key, self._words, self._number = picture, key, words, number

    @property
    def camera(self) -> PinholeCamera:
        """A camera of the picture's size; where it stood is not known."""
        height, width = self._picture.shape[:2]
        return PinholeCamera(position_w=np.zeros(3), axes_w=np.eye(3), fovy_rad=1.0, height=height, width=width)

    @property
    def scene_key(self) -> tuple[int, ...]:
        """The number."""
        return (self._number,)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture."""
        return self._picture.copy()

    def depth_m(self) -> NDArray[np.float32]:
        """Refuse: nothing was measured.

        Raises:
            ConfigurationError: Always.
        """
        raise ConfigurationError("this picture has no depth; use a mask source that needs none")

    def shot(self) -> Shot:
        """Return the picture, without depth."""
        return Shot(picture=self._picture)

    def command_key(self, command: Command) -> str:
        """Return the key."""
        return self._key

    def place_w(self, command: Command) -> None:
        """Nobody has said where the target was."""

    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> None:
        """Targets are objects."""

    def words(self, command: Command) -> str:
        """Return the words."""
        return self._words

    def other_commands(self) -> list[Command]:
        """Return none: nobody knows what else there was."""
        return []

    def true_mask(self, command: Command) -> Pixels:
        """Refuse: there is no simulator.

        Raises:
            ConfigurationError: Always.
        """
        raise ConfigurationError("the source 'oracle' asks a simulator, and this picture is not of one")
