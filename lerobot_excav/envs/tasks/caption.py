"""A line of words at the foot of a picture."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

# All tuned by eye.
_BAR_SHARE, _LEAST_BAR_PX = 0.06, 11
_FONT_SHARE = 0.66
_BAR_RGBA = (12, 14, 18, 190)
_WORDS_RGB = (240, 240, 235)
_SUCCESS_RGB, _FAILURE_RGB = (70, 190, 95), (235, 95, 70)
_GAP = 1.2  # between two words, in heights of the font


@dataclass(frozen=True, kw_only=True)
class Caption:
    """What a picture says of an episode.

    Attributes:
        words: Short texts, the most telling first; those for which there is no room are left out.
        outcome: How it ended; None while that is open.
        is_success: Whether it ended well.
    """

    words: tuple[str, ...]
    outcome: str | None
    is_success: bool


def captioned(picture: NDArray[np.uint8], caption: Caption) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) with a caption over its lowest rows: words from the left, the outcome at the right."""
    height, width = picture.shape[:2]
    bar = bar_height_px(height)
    font = words_font(max(8.0, _FONT_SHARE * bar))
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image, "RGBA")
    draw.rectangle((0, height - bar, width, height), fill=_BAR_RGBA)
    middle, gap, right = height - 0.5 * bar, round(_GAP * font.size), width
    if caption.outcome is not None:
        colour = _SUCCESS_RGB if caption.is_success else _FAILURE_RGB
        right -= round(font.getlength(caption.outcome)) + gap // 2
        draw.text((right, middle), caption.outcome, font=font, fill=colour, anchor="lm")
    left = gap // 2
    for word in caption.words:
        end = left + round(font.getlength(word))
        if end + gap // 2 > right:
            break
        draw.text((left, middle), word, font=font, fill=_WORDS_RGB, anchor="lm")
        left = end + gap
    return np.array(image)


def bar_height_px(height: int) -> int:
    """Return how many of the lowest rows of a picture of this height a caption covers."""
    return max(_LEAST_BAR_PX, round(_BAR_SHARE * height))


@cache
def words_font(size: float) -> ImageFont.FreeTypeFont:
    """Return the font of words in pictures, in a size [px]."""
    font = ImageFont.load_default(size)
    assert isinstance(font, ImageFont.FreeTypeFont)  # Pillow's wheels have FreeType
    return font
