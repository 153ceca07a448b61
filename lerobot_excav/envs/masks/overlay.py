"""A mask drawn into a picture."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.masks.corrupted import grown

TINT_RGB = (235, 60, 40)
OUTLINE_RGB = (255, 255, 255)
_TINT = 0.35


def tinted(image: NDArray[np.uint8], pixels: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) with some pixels (H, W) tinted and outlined: they may be as red as the tint."""
    result = image.copy()
    result[pixels] = ((1.0 - _TINT) * image[pixels] + _TINT * np.array(TINT_RGB)).astype(np.uint8)
    result[grown(pixels) & ~pixels] = OUTLINE_RGB
    return result
