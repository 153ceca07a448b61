import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.masks.click.network import PICTURE_SIZE, WINDOW_PX
from lerobot_excav.envs.masks.click.window import brought, cut_out, put_back, window

HEIGHT, WIDTH = PICTURE_SIZE
PLACES = {"row": st.integers(0, HEIGHT - 1), "column": st.integers(0, WIDTH - 1)}


@given(**PLACES)
def test_what_is_cut_out_and_put_back_is_the_mask_within_the_window(row, column):
    mask = np.random.default_rng(0).random(PICTURE_SIZE) < 0.3
    part = cut_out(mask, row, column)
    assert part.shape == (WINDOW_PX, WINDOW_PX)
    rows, columns = np.indices(PICTURE_SIZE)
    half = WINDOW_PX // 2
    inside = (rows >= row - half) & (rows < row + half) & (columns >= column - half) & (columns < column + half)
    assert np.array_equal(put_back(part, row, column), mask & inside)


@given(**PLACES)
def test_the_clicked_pixel_is_in_the_middle_with_its_colour_and_its_place(row, column):
    picture = np.random.default_rng(0).integers(0, 256, (*PICTURE_SIZE, 3), dtype=np.uint8)
    seen = window(picture, row, column)
    middle = seen[:, WINDOW_PX // 2, WINDOW_PX // 2]
    assert np.allclose((middle[:3] + 1.0) * 127.5, picture[row, column], atol=1e-3)
    assert np.allclose((middle[3:] + 1.0) / 2.0 * PICTURE_SIZE, (row, column), atol=1e-3)
    assert np.abs(seen[:3]).max() <= 1.0


def test_pictures_of_other_sizes_are_brought_to_one():
    small = np.full((48, 64, 3), 90, np.uint8)
    assert brought(small).shape == (*PICTURE_SIZE, 3)
    assert (brought(small) == 90).all()
