"""A small picture in the corner of a large one."""

import numpy as np
from numpy.typing import NDArray

# All tuned by eye.
_SHARE = 0.36
_FRAME_SHARE = 0.006
_FRAME_RGB = (240, 240, 235)


def inset_size(height: int, width: int) -> tuple[int, int]:
    """Return height and width of the small picture in one of a height and a width [px]."""
    return max(1, round(_SHARE * height)), max(1, round(_SHARE * width))


def with_inset(picture: NDArray[np.uint8], small: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) with a second one, of `inset_size`, framed in its upper left corner."""
    frame, (height, width) = max(1, round(_FRAME_SHARE * picture.shape[0])), small.shape[:2]
    result = picture.copy()
    result[: height + 2 * frame, : width + 2 * frame] = _FRAME_RGB
    result[frame : frame + height, frame : frame + width] = small
    return result
