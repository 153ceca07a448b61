import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from lerobot_excav.envs.masks.overlap import MaskOverlap

masks = hnp.arrays(bool, (3, 4))


def square(row):
    pixels = np.zeros((6, 6), dtype=bool)
    pixels[row : row + 2, 1:3] = True
    return pixels


def overlap(target, *shown):
    one = MaskOverlap()
    one.begin(target)
    for frame, pixels in enumerate(shown):
        one.add(pixels, frame)
    return one.mean


@pytest.mark.parametrize(("row", "expected"), [(0, 1.0), (1, 1 / 3), (2, 0.0)])
def test_overlap_is_intersection_over_union(row, expected):
    assert overlap(square(0), square(row)) == pytest.approx(expected)


def test_an_empty_mask_fits_nothing_and_frames_weigh_the_same():
    nothing = np.zeros((6, 6), dtype=bool)
    assert overlap(square(0), nothing) == 0.0
    assert overlap(nothing, nothing) == 0.0
    assert overlap(square(0), square(0), nothing, nothing, square(0)) == 0.5


def test_without_a_frame_or_a_target_there_is_no_overlap():
    one = MaskOverlap()
    one.add(square(0), 0)
    assert one.mean is None
    one.begin(square(0))
    one.add(square(0), 0)
    assert one.mean == 1.0
    one.forget()
    one.add(square(0), 0)
    assert one.mean is None


def test_a_new_target_counts_from_its_frame_on():
    one = MaskOverlap()
    for frame, target in enumerate((square(0), square(3))):
        one.begin(target)
        one.add(square(0), frame)
    assert one.mean == 0.5


def test_a_frame_that_is_seen_again_counts_once_as_it_was_seen_last():
    one = MaskOverlap()
    one.begin(square(0))
    one.add(square(0), 0)
    for shown in (square(3), square(0), square(3)):
        one.add(shown, 1)
    assert one.mean == 0.5


@given(masks, masks)
def test_overlap_is_symmetric_and_one_for_equal_masks_only(one, other):
    value = overlap(one, other)
    assert value == overlap(other, one)
    assert 0.0 <= value <= 1.0
    assert (value == 1.0) == (np.array_equal(one, other) and bool(one.any()))


@given(masks, st.integers(1, 5))
def test_the_mean_of_the_same_mask_is_its_overlap(mask, frames):
    assert overlap(np.ones((3, 4), bool), *[mask] * frames) == pytest.approx(mask.mean())
