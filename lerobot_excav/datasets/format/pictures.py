"""The pictures of one camera in one episode, wherever a dataset keeps them: in the table of frames or in a video."""

import hashlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.errors import DatasetError


class Pictures(Protocol):
    """The pictures of one camera in one episode."""

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""

    def digests(self) -> list[bytes]:
        """Return a digest of every picture; equal pictures of one writer have equal digests."""

    def first(self) -> "Pictures":
        """Return something that holds the first picture only, so that the rest can be forgotten."""


@dataclass(frozen=True)
class StoredImages:
    """Pictures as files within a column of the table."""

    column: pa.ChunkedArray  # one record per frame, with the file's `bytes`

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""
        return np.asarray(Image.open(io.BytesIO(self.column[number]["bytes"].as_py())).convert("RGB"))

    def digests(self) -> list[bytes]:
        """Return a digest of every file."""
        return [hashlib.sha256(value["bytes"].as_py()).digest() for value in self.column]

    def first(self) -> "StoredImages":
        """Return a copy of the first picture."""
        return StoredImages(pa.chunked_array([pa.array(self.column[:1].to_pylist(), self.column.type)]))


@dataclass(frozen=True, kw_only=True)
class VideoSpan:
    """Pictures as a part of a video file, which several episodes may share."""

    path: Path  # the file
    start_s: float  # time of the first picture in the file [s]
    fps: int  # pictures per second
    length: int  # number of pictures

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""
        return next(self._from(number))

    def digests(self) -> list[bytes]:
        """Return a digest of every picture."""
        return [hashlib.sha256(picture.tobytes()).digest() for picture in self._from(0)]

    def first(self) -> "VideoSpan":
        """Return the span itself: it holds no picture."""
        return self

    def _from(self, number: int) -> Iterator[NDArray[Any]]:
        """Decode the pictures from a number on, as LeRobot decodes them.

        Raises:
            DatasetError: The file lacks a picture.
        """
        import av

        with av.open(str(self.path)) as container:
            stream = container.streams.video[0]
            time_base = stream.time_base
            assert time_base is not None  # of a file that holds pictures
            container.seek(round((self.start_s + number / self.fps) / time_base), backward=True, stream=stream)
            for picture in container.decode(stream):
                found = round((float(picture.pts * time_base) - self.start_s) * self.fps)
                if found == number:
                    yield picture.to_ndarray(format="rgb24")
                    number += 1
                if number == self.length:
                    return
        raise DatasetError(f"{self.path} lacks the picture at {self.start_s + number / self.fps:.3f} s")
