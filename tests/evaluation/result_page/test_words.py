"""Strips of words."""

import numpy as np
import pytest

from lerobot_excav.evaluation.result_page.words import STRIP_HEIGHT, strip


@pytest.mark.parametrize("width", [64, 255, 1024])
@pytest.mark.parametrize("words", ["", "success", "paired, channel and token; wrong mask " * 9])
def test_a_strip_is_as_wide_as_asked_for_and_keeps_its_height(words, width):
    assert strip(words, width).shape == (STRIP_HEIGHT, width, 3)


def test_words_are_drawn_and_other_words_otherwise():
    assert (strip("", 256) == strip("", 256)[0, 0]).all()
    assert not np.array_equal(strip("success", 256), strip("failure", 256))


def test_long_words_become_smaller_before_they_are_cut():
    words = "did what the wrong mask said, twice"
    wide, narrow = strip(words, 512), strip(words, 220)
    inked = [np.flatnonzero((picture > 120).any(axis=(1, 2))) for picture in (wide, narrow)]
    assert np.ptp(inked[1]) < np.ptp(inked[0])
    assert (narrow[:, -3:] < 60).all()


def test_a_mark_has_its_colour():
    picture = strip("failure", 256, colour=(200, 10, 20))
    assert tuple(picture[STRIP_HEIGHT // 2, STRIP_HEIGHT // 4 + 2]) == (200, 10, 20)
