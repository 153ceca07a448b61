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
        depth_m: (H, W) float32, registered with it: distance along the optical axis [m], NaN where nothing was
            measured; None without a depth camera.
        camera: Where its camera stood, and how it projects; None if nobody has calibrated it.
    """

    def __init__(
        self,
        picture: NDArray[np.uint8],
        *,
        key: str,
        words: str,
        number: int = 0,
        depth_m: NDArray[np.float32] | None = None,
        camera: PinholeCamera | None = None,
    ) -> None:
        self._key, self._words, self._number = key, words, number
        self._shot = Shot(picture=picture, depth_m=depth_m, camera=camera)

    @property
    def camera(self) -> PinholeCamera:
        """The camera; of one that nobody has calibrated, its size alone means something."""
        if self._shot.camera is not None:
            return self._shot.camera
        height, width = self._shot.size
        return PinholeCamera(position_w=np.zeros(3), axes_w=np.eye(3), fovy_rad=1.0, height=height, width=width)

    @property
    def scene_key(self) -> tuple[int, ...]:
        """The number."""
        return (self._number,)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture."""
        return self._shot.picture.copy()

    def depth_m(self) -> NDArray[np.float32]:
        """Return the depth image, (H, W) float32 [m].

        Raises:
            ConfigurationError: There was no depth camera.
        """
        if self._shot.depth_m is None:
            raise ConfigurationError("this picture has no depth; use a mask source that needs none")
        return self._shot.depth_m.copy()

    def shot(self) -> Shot:
        """Return the picture, with depth and camera as far as they are known."""
        return self._shot

    def command_key(self, command: Command) -> str:
        """Return the key."""
        return self._key

    def place_w(self, command: Command) -> NDArray[np.float64] | None:
        """Return none: nobody has said where the target was."""
        return None

    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels | None:
        """Return none: targets are objects."""
        return None

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
