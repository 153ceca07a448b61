"""Strips of words between the pictures of a video grid."""

import numpy as np
from PIL import Image, ImageDraw

from lerobot_excav.envs.tasks.caption import words_font
from lerobot_excav.evaluation.video import Image as Picture

STRIP_HEIGHT = 24  # even, for codecs; tuned by eye

_BACK_RGB, _WORDS_RGB = (12, 14, 18), (240, 240, 235)
_SIZES = (15.0, 13.0, 11.0, 9.0)  # the greatest that fits


def strip(words: str, width: int, colour: tuple[int, int, int] | None = None) -> Picture:
    """Return words on a dark strip, (STRIP_HEIGHT, width, 3).

    Args:
        words: What it says; made smaller, and in the end cut, if there is no room.
        width: Width of the strip [px].
        colour: Of a mark before the words; none without it.
    """
    image = Image.new("RGB", (width, STRIP_HEIGHT), _BACK_RGB)
    draw = ImageDraw.Draw(image)
    middle, gap = STRIP_HEIGHT // 2, STRIP_HEIGHT // 4
    left = gap
    if colour is not None:
        draw.rectangle((gap, gap, 3 * gap, STRIP_HEIGHT - gap), fill=colour)
        left = 4 * gap
    fonts = [words_font(size) for size in _SIZES]
    font = next((font for font in fonts if left + font.getlength(words) <= width - gap), fonts[-1])
    draw.text((left, middle), words, font=font, fill=_WORDS_RGB, anchor="lm")
    return np.array(image)
