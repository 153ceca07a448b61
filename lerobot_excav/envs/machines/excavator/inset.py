"""A small picture in the corner of a large one."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

# All tuned by eye.
_SHARE = 0.36
_FRAME_SHARE = 0.006
_FRAME_RGB = (240, 240, 235)


def with_inset(picture: NDArray[np.uint8], small: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) with a second one, made smaller and framed, in its upper left corner."""
    height, width = picture.shape[:2]
    frame = max(1, round(_FRAME_SHARE * height))
    size = (max(1, round(_SHARE * width)), max(1, round(_SHARE * height)))
    inset = np.asarray(Image.fromarray(small).resize(size, Image.Resampling.BOX))
    result = picture.copy()
    result[: size[1] + 2 * frame, : size[0] + 2 * frame] = _FRAME_RGB
    result[frame : frame + size[1], frame : frame + size[0]] = inset
    return result
