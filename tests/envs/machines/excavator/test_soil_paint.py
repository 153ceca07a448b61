import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.soil_paint import COMMANDED_RGB, SHOWN_RGB, TEXELS, Patch, SoilPaint

SOIL_RGB, GROUND_RGB = np.array([0.76, 0.60, 0.38]), np.array([0.4, 0.42, 0.4])
CELLS = (120, 120)
PATCH_W = np.array([(1.0, -2.0), (2.0, -2.0), (2.0, -1.5), (1.0, -1.5)])


@pytest.fixture(scope="module")
def paint():
    paint = SoilPaint()
    return lambda heights, start=None, patches=(): paint.paint(
        heights, heights if start is None else start, soil_rgb=SOIL_RGB, ground_rgb=GROUND_RGB, patches=patches
    )


def at(texture, x_w, y_w, reach=6):
    """The mean colour around a place of the dig area."""
    column, row = (round((place + 3.0) / 6.0 * TEXELS) for place in (x_w, y_w))
    return texture[row - reach : row + reach, column - reach : column + reach].mean(axis=(0, 1))


def test_soil_has_its_colour_and_bare_ground_that_of_the_ground(paint):
    heights = np.zeros(CELLS)
    heights[80:, :60] = 0.5  # positive x, negative y
    texture = paint(heights)
    assert (texture.shape, texture.dtype) == ((TEXELS, TEXELS, 3), np.float32)
    assert at(texture, 2.5, -2.0) == pytest.approx(SOIL_RGB, abs=0.05)
    for place in ((2.5, 2.0), (-2.0, -2.0), (-2.0, 2.0)):
        assert at(texture, *place) == pytest.approx(GROUND_RGB, abs=0.05)


def test_a_fresh_cut_is_darker_than_what_lies_untouched(paint):
    start = np.full(CELLS, 0.6)
    now = start.copy()
    now[40:60, 40:60] -= 0.2
    texture, before = paint(now, start), paint(start, start)
    assert at(texture, -0.5, -0.5).mean() < 0.75 * at(before, -0.5, -0.5).mean()
    np.testing.assert_array_equal(at(texture, 2.0, 2.0), at(before, 2.0, 2.0))


def test_hollows_are_darker_than_ridges(paint):
    x = np.linspace(-3.0, 3.0, 120)
    texture = paint(np.tile(0.5 + 0.1 * np.cos(2 * np.pi * x), (120, 1)))  # ridges at whole y
    hollow, ridge = (texture[round((y + 3.0) / 6.0 * TEXELS)].mean() for y in (0.5, 1.0))
    assert hollow < 0.93 * ridge


def test_a_patch_is_tinted_in_its_colour_up_to_its_corners_and_nowhere_else(paint):
    heights = np.full(CELLS, 0.5)
    plain = paint(heights)
    for rgb in (COMMANDED_RGB, SHOWN_RGB):
        marked = paint(heights, patches=[Patch(PATCH_W, rgb)])
        y, x = np.nonzero((marked != plain).any(axis=-1))
        for texels, (low, high) in ((x, (1.0, 2.0)), (y, (-2.0, -1.5))):
            assert 6.0 * (texels.min() + 0.5) / TEXELS - 3.0 == pytest.approx(low, abs=0.02)
            assert 6.0 * (texels.max() + 0.5) / TEXELS - 3.0 == pytest.approx(high, abs=0.02)
        change = at(marked, 1.5, -1.75) - at(plain, 1.5, -1.75)
        assert change @ (np.array(rgb) - SOIL_RGB) > 0.0
