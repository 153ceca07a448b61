import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.masks.mask_noise import noisy_mask
from lerobot_excav.envs.tasks.settings import require_mask_settings
from lerobot_excav.errors import ConfigurationError

HEIGHT, WIDTH = 40, 60


def mask_of(rows, cols):
    mask = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
    mask[rows, cols] = 255
    return mask


BLOB = mask_of(slice(10, 17), slice(20, 29))


def noisy(noise, size_px, *, mask=BLOB, seed=0):
    return noisy_mask(mask, noise, size_px, np.random.default_rng(seed))


def city_block_distance(inside):
    """Distance of every pixel from a set, the slow way."""
    points = np.argwhere(inside)
    grid = np.indices(inside.shape).reshape(2, -1).T
    return np.abs(grid[:, None] - points[None]).sum(axis=-1).min(axis=1).reshape(inside.shape)


def test_no_noise_gives_the_same_mask_in_an_array_of_its_own():
    result = noisy("none", 0)
    assert np.array_equal(result, BLOB)
    assert result is not BLOB


@pytest.mark.parametrize("size_px", [1, 2, 3])
def test_dilation_adds_what_lies_within_the_distance(size_px):
    expected = city_block_distance(BLOB[..., 0] > 0) <= size_px
    assert np.array_equal(noisy("dilate", size_px)[..., 0] > 0, expected)


@pytest.mark.parametrize("size_px", [1, 2, 3])
def test_erosion_leaves_what_lies_beyond_the_distance_from_outside(size_px):
    expected = city_block_distance(BLOB[..., 0] == 0) > size_px
    assert np.array_equal(noisy("erode", size_px)[..., 0] > 0, expected)


def test_erosion_may_leave_nothing():
    assert not noisy("erode", 4).any()


def test_the_edge_of_the_picture_does_not_erode():
    mask = mask_of(slice(0, 9), slice(0, 9))
    assert noisy("erode", 2, mask=mask)[0, 0, 0] == 255


@given(size_px=st.integers(1, 100), seed=st.integers(0, 1000))
def test_a_shifted_blob_keeps_its_shape_inside_the_picture(size_px, seed):
    shifted = noisy("shift", size_px, seed=seed)[..., 0]
    rows, cols = np.nonzero(shifted)
    assert rows.size == (BLOB[..., 0] > 0).sum()
    assert (np.ptp(rows), np.ptp(cols)) == (6, 8)


@given(size_px=st.integers(1, 9), seed=st.integers(0, 1000))
def test_a_blob_far_from_the_edge_is_shifted_by_the_size(size_px, seed):
    moved = np.argwhere(noisy("shift", size_px, seed=seed)[..., 0]).mean(axis=0)
    start = np.argwhere(BLOB[..., 0]).mean(axis=0)
    assert abs(np.linalg.norm(moved - start) - size_px) <= np.sqrt(0.5) + 1e-9


def test_an_empty_mask_stays_empty():
    for noise in ("shift", "erode", "dilate"):
        assert not noisy(noise, 2, mask=np.zeros_like(BLOB)).any()


@pytest.mark.parametrize("noise", ["shift", "erode", "dilate"])
def test_results_are_black_and_white_in_three_equal_channels(noise):
    result = noisy(noise, 2)
    assert set(np.unique(result)) == {0, 255}
    assert (result == result[..., :1]).all()
    assert result.dtype == np.uint8


@pytest.mark.parametrize(
    ("noise", "size_px", "named"),
    [
        ("none", 1, r"env\.mask_noise='none' and env\.mask_noise_px=1 .*or neither"),
        ("shift", 0, r"env\.mask_noise='shift' and env\.mask_noise_px=0 .*from 1 pixel on"),
        ("blur", 1, r"env\.mask_noise='blur' .*'dilate'"),
        ("erode", -1, r"env\.mask_noise_px=-1 "),
        ("erode", 1.5, r"env\.mask_noise_px=1\.5 "),
        ("erode", True, r"env\.mask_noise_px=True "),
    ],
)
def test_kind_and_size_must_belong_together(noise, size_px, named):
    with pytest.raises(ConfigurationError, match=named):
        require_mask_settings("env.", mask_condition="correct", mask_noise=noise, mask_noise_px=size_px)
