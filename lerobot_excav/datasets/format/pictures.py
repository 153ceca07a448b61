"""The pictures of one camera in one episode, wherever a dataset keeps them: in the table of frames or in a video."""

import hashlib
import io
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.errors import DatasetError

TIME_TOLERANCE_S = 1e-4
"""How far the time of a picture or a frame may be from its place in the sequence; LeRobot's own default."""


class Pictures(Protocol):
    """The pictures of one camera in one episode.

    Whoever reads one learns of a DatasetError that it is damaged, missing or of another size than declared.
    """

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""

    def frames(self) -> Iterator[NDArray[Any]]:
        """Decode all pictures in order, one at a time."""

    def digests(self) -> list[bytes]:
        """Return a digest of every picture; equal pictures of one writer have equal digests."""

    def first(self) -> "Pictures":
        """Return something that holds the first picture only, so that the rest can be forgotten."""


@dataclass(frozen=True)
class StoredImages:
    """Pictures as PNG files within a column of the table."""

    column: pa.ChunkedArray  # one record per frame, with the file's `bytes`
    size: tuple[int, int]  # declared height and width [px]

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""
        return self._decoded(self.column[number]["bytes"].as_py(), number)

    def frames(self) -> Iterator[NDArray[Any]]:
        """Decode all pictures in order, one at a time."""
        return (self.frame(number) for number in range(len(self.column)))

    def digests(self) -> list[bytes]:
        """Return a digest of every file."""
        return [hashlib.sha256(value["bytes"].as_py() or b"").digest() for value in self.column]

    def first(self) -> "StoredImages":
        """Return a copy of the first picture."""
        first = pa.chunked_array([pa.array(self.column[:1].to_pylist(), self.column.type)])
        return StoredImages(first, self.size)

    def _decoded(self, file: bytes | None, number: int) -> NDArray[Any]:
        if file is None:
            raise DatasetError(f"frame {number} holds no picture")
        with reading(f"the picture of frame {number}"):
            picture = self._opened(file, number)
            # Checksums first: a changed byte may well be decoded.
            picture.verify()
            return np.asarray(self._opened(file, number))

    def _opened(self, file: bytes, number: int) -> Image.Image:
        """Open a file, but do not decode it: a small one may hold a huge picture."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture = Image.open(io.BytesIO(file), formats=["PNG"])
        _require_size((picture.height, picture.width), self.size, number)
        if picture.mode != "RGB":
            raise DatasetError(f"the picture of frame {number} has the mode {picture.mode!r} instead of 'RGB'")
        return picture


@dataclass(frozen=True, kw_only=True)
class VideoSpan:
    """Pictures as a part of a video file, which several episodes may share."""

    path: Path  # the file
    start_s: float  # time of the first picture in the file [s]
    fps: int  # pictures per second
    length: int  # number of pictures
    size: tuple[int, int]  # declared height and width [px]

    def frame(self, number: int) -> NDArray[Any]:
        """Return a picture, (H, W, 3) uint8."""
        return next(self._from(number))

    def frames(self) -> Iterator[NDArray[Any]]:
        """Decode all pictures in order, one at a time."""
        return self._from(0)

    def digests(self) -> list[bytes]:
        """Return a digest of every picture."""
        return [hashlib.sha256(picture.tobytes()).digest() for picture in self.frames()]

    def first(self) -> "VideoSpan":
        """Return the span itself: it holds no picture."""
        return self

    def _from(self, number: int) -> Iterator[NDArray[Any]]:
        """Decode the pictures from a number on, as LeRobot decodes them."""
        with reading(self.path):
            yield from self._decoded(number)

    def _decoded(self, number: int) -> Iterator[NDArray[Any]]:
        import av

        with av.open(str(self.path)) as container:
            stream = container.streams.video[0]
            if stream.codec_context is None:  # libav's own decoding would end the process
                raise DatasetError(f"{self.path} cannot be read: it names no codec that is known")
            _require_size((stream.height, stream.width), self.size, number)
            # Without this, what is damaged is filled in from the pictures around it.
            stream.codec_context.options = {"err_detect": "explode"}
            time_base = stream.time_base
            assert time_base is not None  # of a file that holds pictures
            container.seek(round((self.start_s + number / self.fps) / time_base), backward=True, stream=stream)
            for picture in container.decode(stream):
                late_s = float(picture.pts * time_base) - self.start_s - number / self.fps
                if abs(late_s) <= TIME_TOLERANCE_S:
                    _require_size((picture.height, picture.width), self.size, number)
                    yield picture.to_ndarray(format="rgb24")
                    number += 1
                if number == self.length:
                    return
        raise DatasetError(f"{self.path} lacks the picture at {self.start_s + number / self.fps:.3f} s")


def _require_size(found: tuple[int, int], declared: tuple[int, int], number: int) -> None:
    if found != declared:
        raise DatasetError(
            f"the picture of frame {number} has {found[0]} x {found[1]} px, declared are {declared[0]} x {declared[1]}"
        )
