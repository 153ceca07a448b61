import numpy as np

from lerobot_excav.envs.masks.overlay import OUTLINE_RGB, TINT_RGB, tinted

MASK = np.zeros((20, 30), dtype=bool)
MASK[8:12, 5:9] = True


def test_marked_pixels_move_towards_the_tint_and_their_neighbours_outline_them():
    image = np.full((20, 30, 3), 100, dtype=np.uint8)
    result = tinted(image, MASK)
    expected = (0.65 * 100 + 0.35 * np.array(TINT_RGB)).astype(np.uint8)
    assert (result[MASK] == expected).all()
    outline = np.argwhere((result == OUTLINE_RGB).all(axis=-1))
    # 4 x 4 pixels have 16 neighbours by an edge.
    assert len(outline) == 16
    assert (result[7, 5:9] == OUTLINE_RGB).all()
    changed = (result != image).any(axis=-1)
    assert changed.sum() == 16 + 16


def test_a_mask_at_the_edge_is_outlined_inside_the_picture():
    result = tinted(np.zeros((20, 30, 3), dtype=np.uint8), np.arange(600).reshape(20, 30) == 0)
    assert (result == OUTLINE_RGB).all(axis=-1).sum() == 2


def test_tinting_leaves_the_picture_as_it_was_and_an_empty_mask_changes_nothing():
    image = np.full((20, 30, 3), 100, dtype=np.uint8)
    tinted(image, MASK)
    assert (image == 100).all()
    assert np.array_equal(tinted(image, np.zeros((20, 30), dtype=bool)), image)
