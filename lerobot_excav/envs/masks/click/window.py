"""The part of a picture around a click that the network sees."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.envs.masks.click.network import PICTURE_SIZE, WINDOW_PX


def brought(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) in `PICTURE_SIZE`."""
    height, width = PICTURE_SIZE
    if picture.shape[:2] == (height, width):
        return picture
    return np.asarray(Image.fromarray(picture).resize((width, height), Image.Resampling.BILINEAR))


def window(picture: NDArray[np.uint8], row: int, column: int) -> NDArray[np.float32]:
    """Return what the network sees around a pixel of a picture of `PICTURE_SIZE`, (5, S, S) float32 in [-1, 1].

    Beyond the picture's border its edge is repeated.
    """
    rows, columns = _around(row, picture.shape[0]), _around(column, picture.shape[1])
    colours = picture[rows[:, None], columns[None, :]].astype(np.float32).transpose(2, 0, 1) / 127.5 - 1.0
    down, right = (2.0 * _unclipped(at) / length - 1.0 for at, length in zip((row, column), PICTURE_SIZE, strict=True))
    places = np.broadcast_arrays(down[:, None], right[None, :])
    seen: NDArray[np.float32] = np.concatenate([colours, np.stack(places)]).astype(np.float32)
    return seen


def cut_out(mask: NDArray[np.bool_], row: int, column: int) -> NDArray[np.bool_]:
    """Return the part of a mask of `PICTURE_SIZE` that the window around a pixel shows, (S, S); beyond is nothing."""
    rows, columns = _unclipped(row), _unclipped(column)
    is_in = _is_in(rows, mask.shape[0])[:, None] & _is_in(columns, mask.shape[1])[None, :]
    clipped = mask[_around(row, mask.shape[0])[:, None], _around(column, mask.shape[1])[None, :]]
    return np.asarray(clipped & is_in)


def put_back(part: NDArray[np.bool_], row: int, column: int) -> NDArray[np.bool_]:
    """Return a mask of `PICTURE_SIZE` with a window's mask (S, S) around a pixel; the inverse of `cut_out`."""
    mask = np.zeros(PICTURE_SIZE, bool)
    rows, columns = _unclipped(row), _unclipped(column)
    in_rows, in_columns = _is_in(rows, PICTURE_SIZE[0]), _is_in(columns, PICTURE_SIZE[1])
    mask[np.ix_(rows[in_rows], columns[in_columns])] = part[np.ix_(in_rows, in_columns)]
    return mask


def _unclipped(middle: int) -> NDArray[np.int64]:
    return middle - WINDOW_PX // 2 + np.arange(WINDOW_PX)


def _around(middle: int, length: int) -> NDArray[np.int64]:
    return np.clip(_unclipped(middle), 0, length - 1)


def _is_in(numbers: NDArray[np.int64], length: int) -> NDArray[np.bool_]:
    return (numbers >= 0) & (numbers < length)
