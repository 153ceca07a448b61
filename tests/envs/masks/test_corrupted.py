import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.corrupted import MASK_NOISES, CorruptedSource, moved_elsewhere, noisy_pixels
from lerobot_excav.envs.masks.oracle import OracleSource
from lerobot_excav.envs.masks.source import TargetMask
from lerobot_excav.errors import ConfigurationError, ExcavError

HEIGHT, WIDTH = 40, 60


def blob(rows, cols, shape=(HEIGHT, WIDTH)):
    inside = np.zeros(shape, dtype=bool)
    inside[rows, cols] = True
    return inside


BLOB = blob(slice(10, 17), slice(20, 29))
TARGETS = [blob(slice(5 + 2 * i, 12 + 2 * i), slice(4 + 12 * i, 13 + 12 * i)) for i in range(4)]


class View:
    """Four targets in a picture; `hidden` are out of sight."""

    camera = SimpleNamespace(height=HEIGHT, width=WIDTH)

    def __init__(self, scene_id=0, hidden=()):
        self.scene_key, self.hidden = (0, scene_id), hidden

    def true_mask(self, command):
        return TARGETS[command.target_id] & (command.target_id not in self.hidden)

    def other_commands(self):
        return [command(i) for i in range(4) if i != self.commanded]


def command(target_id):
    return Command(target_id=target_id, region=target_id)


def shown(target_id=2, *, scene_id=0, condition="correct", noise="none", noise_px=0, hidden=()):
    view = View(scene_id, hidden)
    view.commanded = target_id
    source = CorruptedSource(OracleSource(), condition=condition, noise=noise, noise_px=noise_px)
    return source.mask(view, command(target_id))


def test_correct_shows_the_target_and_says_where_the_mask_comes_from():
    mask = shown(2)
    assert np.array_equal(mask.pixels, TARGETS[2])
    assert (mask.target_id, mask.source) == (2, "oracle")
    assert mask.parameters == {"condition": "correct", "noise": "none", "noise_px": 0}
    assert set(np.unique(mask.img)) == {0, 255}
    assert mask.img.shape == (HEIGHT, WIDTH, 3)


def test_zero_shows_nothing_even_of_a_target_out_of_sight():
    for hidden in ((), (2,)):
        mask = shown(2, condition="zero", hidden=hidden)
        assert not mask.pixels.any()
        assert mask.target_id is None


@pytest.mark.parametrize("target_id", range(4))
def test_random_shows_a_blob_of_the_same_size_off_its_place(target_id):
    for scene_id in range(20):
        mask = shown(target_id, scene_id=scene_id, condition="random")
        assert mask.pixels.sum() == TARGETS[target_id].sum()
        assert not (mask.pixels & TARGETS[target_id]).any()
        assert mask.target_id is None


@pytest.mark.parametrize("target_id", range(4))
def test_mismatched_shows_another_target_and_in_time_every_other(target_id):
    masks = [shown(target_id, scene_id=scene_id, condition="mismatched") for scene_id in range(60)]
    assert {mask.target_id for mask in masks} == set(range(4)) - {target_id}
    assert all(np.array_equal(mask.pixels, TARGETS[mask.target_id]) for mask in masks)


@pytest.mark.parametrize("condition", ["correct", "random"])
def test_what_the_source_does_not_find_stays_missing(condition):
    assert shown(2, condition=condition, hidden=(2,)) is None


@pytest.mark.parametrize("noise", ["none", "shift", "dilate"])
@pytest.mark.parametrize("condition", ["random", "mismatched", "correct"])
def test_the_same_scene_and_target_are_always_shown_the_same(condition, noise):
    options = {"condition": condition, "noise": noise, "noise_px": 2 if noise != "none" else 0}
    assert np.array_equal(shown(1, **options).pixels, shown(1, **options).pixels)


def test_a_blob_that_erosion_removes_is_a_mask_that_is_missing():
    assert shown(1, noise="erode", noise_px=3) is not None
    assert shown(1, noise="erode", noise_px=4) is None


def test_blob_too_large_to_move_says_what_to_change(rng):
    with pytest.raises(ExcavError, match="observation_height"):
        moved_elsewhere(np.ones((20, 20), dtype=bool), rng)


def noisy(noise, size_px, *, inside=BLOB, seed=0):
    return noisy_pixels(inside, noise, size_px, np.random.default_rng(seed))


def city_block_distance(inside):
    """Distance of every pixel from a set, the slow way."""
    points = np.argwhere(inside)
    grid = np.indices(inside.shape).reshape(2, -1).T
    return np.abs(grid[:, None] - points[None]).sum(axis=-1).min(axis=1).reshape(inside.shape)


@pytest.mark.parametrize("size_px", [1, 2, 3])
def test_dilation_adds_and_erosion_removes_what_lies_within_the_distance(size_px):
    assert np.array_equal(noisy("dilate", size_px), city_block_distance(BLOB) <= size_px)
    assert np.array_equal(noisy("erode", size_px), city_block_distance(~BLOB) > size_px)


def test_no_noise_gives_the_same_mask_in_an_array_of_its_own():
    result = noisy("none", 0)
    assert np.array_equal(result, BLOB)
    assert not np.shares_memory(result, BLOB)


def test_the_edge_of_the_picture_does_not_erode():
    assert noisy("erode", 2, inside=blob(slice(0, 9), slice(0, 9)))[0, 0]


@given(size_px=st.integers(1, 100), seed=st.integers(0, 1000))
def test_a_shifted_blob_keeps_its_shape_inside_the_picture(size_px, seed):
    rows, cols = np.nonzero(noisy("shift", size_px, seed=seed))
    assert rows.size == BLOB.sum()
    assert (np.ptp(rows), np.ptp(cols)) == (6, 8)


@given(size_px=st.integers(1, 9), seed=st.integers(0, 1000))
def test_a_blob_far_from_the_edge_is_shifted_by_the_size(size_px, seed):
    moved = np.argwhere(noisy("shift", size_px, seed=seed)).mean(axis=0)
    start = np.argwhere(BLOB).mean(axis=0)
    assert abs(np.linalg.norm(moved - start) - size_px) <= np.sqrt(0.5) + 1e-9


class Returns:
    """A source that returns what it was given."""

    def __init__(self, mask):
        self.mask = lambda view, command: mask


def corrupted(pixels, **settings):
    mask = TargetMask(pixels=pixels, target_id=0, source="mine") if isinstance(pixels, np.ndarray) else pixels
    given = {"condition": "correct", "noise": "none", "noise_px": 0, **settings}
    return CorruptedSource(Returns(mask), **given).mask(View(), command(0))


@pytest.mark.parametrize("settings", [{}, {"noise": "shift", "noise_px": 3}, {"condition": "random"}])
def test_an_empty_mask_counts_as_nothing(settings):
    assert corrupted(np.zeros((HEIGHT, WIDTH), bool), **settings) is None


@pytest.mark.parametrize(
    ("returned", "named"),
    [
        (np.ones((5, 5), bool), r"Returns returned pixels of shape \(5, 5\) .*\(40, 60\) of bool"),
        (np.full((HEIGHT, WIDTH), 255, np.uint8), "type uint8"),
        ("a mask", "Returns returned a str; return a TargetMask, or None"),
    ],
)
def test_what_is_not_a_mask_of_the_pictures_size_is_refused(returned, named):
    with pytest.raises(ConfigurationError, match=named):
        corrupted(returned)


def flickering(target_id, frame, *, noise="flicker", scene_id=0):
    view, source = View(scene_id, ()), CorruptedSource(OracleSource(), condition="correct", noise=noise, noise_px=3)
    view.commanded = target_id
    return source.at_frame(source.mask(view, command(target_id)), view, command(target_id), frame).pixels


def test_a_mask_that_flickers_moves_by_its_size_around_its_place():
    middle = np.argwhere(TARGETS[2]).mean(axis=0)
    shifts = [np.argwhere(flickering(2, frame)).mean(axis=0) - middle for frame in range(200)]
    assert np.abs(np.linalg.norm(shifts, axis=1) - 3.0).max() < 0.75  # whole pixels
    assert np.linalg.norm(np.mean(shifts, axis=0)) < 0.6  # no direction is preferred
    assert len({tuple(shift) for shift in shifts}) > 8


def ways(target_id, frames=range(10), **others):
    """Return by how much a mask is moved at some frames [px]."""
    middle = np.argwhere(TARGETS[target_id]).mean(axis=0)
    return [tuple(np.argwhere(flickering(target_id, frame, **others)).mean(axis=0) - middle) for frame in frames]


def test_how_a_mask_flickers_depends_on_scene_target_and_frame():
    assert ways(2) == ways(2)
    for others in (ways(1), ways(2, scene_id=1), ways(2, frames=range(1, 11))):
        assert others != ways(2)


def is_missing(frame, *, target_id=2, scene_id=0, **settings):
    """Whether the mask is missing at a frame; it is whole otherwise."""
    view = View(scene_id, ())
    settings = {"condition": "correct", "noise": "none", "noise_px": 0, "dropout": 0.3, **settings}
    source = CorruptedSource(OracleSource(), **settings)
    mask = source.mask(view, command(target_id))
    seen = source.at_frame(mask, view, command(target_id), frame)
    assert seen.target_id == target_id
    assert not seen.pixels.any() or np.array_equal(seen.pixels, mask.pixels) or settings["noise"] == "flicker"
    return not seen.pixels.any()


def test_a_mask_drops_out_at_its_share_of_the_frames_each_by_itself():
    missing = [is_missing(frame) for frame in range(1000)]
    assert abs(np.mean(missing) - 0.3) < 0.05  # more than three standard deviations
    after = [is_now for was, is_now in itertools.pairwise(missing) if was]
    assert abs(np.mean(after) - 0.3) < 0.09
    assert missing[:20] == [is_missing(frame) for frame in range(20)]
    for others in ({"target_id": 1}, {"scene_id": 1}):
        assert missing[:40] != [is_missing(frame, **others) for frame in range(40)]


def test_a_mask_that_flickers_drops_out_at_the_same_frames():
    frames = range(40)
    flickers = [is_missing(frame, noise="flicker", noise_px=3) for frame in frames]
    assert flickers == [is_missing(frame) for frame in frames]


@pytest.mark.parametrize("noise", [noise for noise in MASK_NOISES if noise not in ("none", "flicker")])
def test_other_noise_stays_as_it_is_from_frame_to_frame(noise):
    assert np.array_equal(flickering(1, 0, noise=noise), flickering(1, 9, noise=noise))
