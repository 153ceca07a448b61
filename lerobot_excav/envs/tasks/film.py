"""The film of an episode that an environment writes while it goes on, with its very last picture."""

from itertools import chain, count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.video_file import VideoFile

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

    @property
    def is_running(self) -> bool:
        """Whether an episode is being filmed."""
        return self._video is not None

    def begin(self, name: str) -> None:
        """Begin the film of an episode; one that has not come to its end is left out.

        Where a film of this name exists, as of the same scene at an earlier evaluation of a training, it stays, and the
        new one gets a number behind its name.

        Raises:
            OSError: It cannot be written.
        """
        self.leave_out()
        names = chain([name], (f"{name}_{number}" for number in count(2)))
        paths = (self._folder / f"{name}.mp4" for name in names)
        self._video = VideoFile(next(path for path in paths if not path.exists()), self._fps, crf=_QUALITY)

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
