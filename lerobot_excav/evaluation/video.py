"""Writing videos, and reading them."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.envs.tasks.video_file import VideoFile

Image = NDArray[np.uint8]


def write_video(path: Path, frames: Iterable[Image], fps: int, *, crf: int) -> None:
    """Write pictures as H.264 video, which appears when it is complete.

    Args:
        path: File to write (mp4); its folder is made.
        frames: At least one picture, uint8 (H, W, 3), all of one size; an odd last row or column is cut off.
        fps: Pictures per second.
        crf: Constant rate factor of x264: 18 is lossless to the eye, 28 coarse.
    """
    video = VideoFile(path, fps, crf=crf)
    try:
        for image in frames:
            video.add(image)
        video.finish()
    except BaseException:
        video.discard()
        raise


def read_video(path: Path) -> Iterator[Image]:
    """Yield the pictures of a video, uint8 (H, W, 3).

    Raises:
        DatasetError: The file is damaged.
    """
    with reading(path), av.open(str(path)) as container:
        for frame in container.decode(video=0):
            yield frame.to_ndarray(format="rgb24")
