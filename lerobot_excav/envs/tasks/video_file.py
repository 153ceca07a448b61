"""A video that is written picture by picture, and appears when it is complete."""

from contextlib import ExitStack, suppress
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.whole_file import whole_file


class VideoFile:
    """H.264 in an mp4 file.

    Args:
        path: File to write; its folder is made.
        fps: Pictures per second.
        crf: Constant rate factor of x264: 18 is lossless to the eye, 28 coarse.

    Raises:
        OSError: The file cannot be written.
    """

    def __init__(self, path: Path, fps: int, *, crf: int) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stack = ExitStack()
        temporary = self._stack.enter_context(whole_file(path))
        self._container = self._stack.enter_context(av.open(str(temporary), mode="w", format="mp4"))
        self._stream = self._container.add_stream("libx264", rate=Fraction(fps))
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {"crf": str(crf), "preset": "slow"}

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append a picture (H, W, 3), of the size of the first; an odd last row or column is cut off."""
        height, width = (size - size % 2 for size in image.shape[:2])
        self._stream.height, self._stream.width = height, width
        even = np.ascontiguousarray(image[:height, :width])
        self._container.mux(self._stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")))

    def finish(self) -> None:
        """Let the file appear; it holds at least one picture."""
        self._container.mux(self._stream.encode(None))
        self._stack.close()

    def discard(self) -> None:
        """Leave nothing."""
        # What writes whole files keeps the old one when it is told of an error.
        with suppress(_Discarded), self._stack:
            raise _Discarded


class _Discarded(Exception):  # noqa: N818 - nothing is wrong
    """A video is not wanted any more."""
