"""The film of an episode that an environment writes while it goes on, with its very last picture."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.video_file import VideoFile
from lerobot_excav.errors import ConfigurationError

_QUALITY = 22


class Film:
    """Films in a folder, one for every episode that comes to its end.

    Args:
        folder: Where they appear; it is made.
        fps: Pictures per second.
    """

    def __init__(self, folder: Path, fps: int) -> None:
        self._folder, self._fps = folder, fps
        self._video: VideoFile | None = None

    def begin(self, name: str) -> None:
        """Begin the film of an episode; one that has not come to its end is left out.

        Raises:
            ConfigurationError: There is a film of this name.
            OSError: It cannot be written.
        """
        self.leave_out()
        path = self._folder / f"{name}.mp4"
        if path.exists():
            raise ConfigurationError(f"film_folder: {path} exists; choose another film_folder, or move the film away")
        self._video = VideoFile(path, self._fps, crf=_QUALITY)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Append a picture (H, W, 3)."""
        assert self._video is not None  # it has begun
        self._video.add(picture)

    def end(self) -> None:
        """Let the film appear."""
        if self._video is not None:
            video, self._video = self._video, None
            video.finish()

    def leave_out(self) -> None:
        """Leave no film of the running episode."""
        if self._video is not None:
            video, self._video = self._video, None
            video.discard()
