"""A mask drawn into a picture."""

import numpy as np
from numpy.typing import NDArray

TINT_RGB = (235, 60, 40)
OUTLINE_RGB = (255, 255, 255)
_TINT = 0.35


def tinted(image: NDArray[np.uint8], pixels: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return a picture with some pixels tinted and outlined: what they show may be as red as the tint.

    Args:
        image: uint8 (H, W, 3).
        pixels: bool (H, W).
    """
    result = image.copy()
    result[pixels] = ((1.0 - _TINT) * image[pixels] + _TINT * np.array(TINT_RGB)).astype(np.uint8)
    around = np.pad(pixels, 1)
    touched = around[2:, 1:-1] | around[:-2, 1:-1] | around[1:-1, 2:] | around[1:-1, :-2]
    result[touched & ~pixels] = OUTLINE_RGB
    return result
