"""Imprecise masks are snapped onto what lies under their middle; `fr5_grasp` shows it, and its blocks are objects."""

from dataclasses import replace

import numpy as np
import pytest

from lerobot_excav.envs.masks.corrupted import CorruptedSource
from lerobot_excav.envs.masks.oracle import OracleSource
from lerobot_excav.envs.masks.snapped import SnappedMasks, SnappedSource
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv

SCENES = range(6)
SHIFT = {"mask_noise": "shift", "mask_noise_px": 4}


def masks(**settings):
    """Return the first mask of some scenes, (n, H, W) bool."""
    env = FR5GraspEnv(scene_set="val", **settings)
    shown = []
    for scene in SCENES:
        env.reset(seed=scene)
        shown.append(env.mask.pixels)
    env.close()
    return np.stack(shown)


def overlap(some, others):
    """Return the intersection over union of masks, one by one."""
    return (some & others).sum(axis=(1, 2)) / (some | others).sum(axis=(1, 2))


@pytest.fixture(scope="module")
def right():
    return masks()


@pytest.mark.parametrize("noise", ["shift", "flicker"])
def test_masks_that_lie_beside_their_blocks_are_brought_back(right, noise):
    settings = {**SHIFT, "mask_noise": noise}
    assert overlap(masks(mask_snap=True, **settings), right).min() > 0.8


def test_masks_that_lie_beside_their_blocks_stay_there_otherwise(right):
    assert overlap(masks(**SHIFT), right).max() < 0.6


def test_exact_masks_stay_nearly_as_they_are(right):
    assert overlap(masks(mask_snap=True), right).min() > 0.8


def test_a_flickering_mask_is_held_as_it_was_snapped():
    env = FR5GraspEnv(scene_set="val", mask_noise="flicker", mask_noise_px=3, mask_snap=True)
    env.reset(seed=1)
    first = env.mask.pixels
    for _ in range(4):
        env.step(env.holding_action())
        assert np.array_equal(env.mask.pixels, first)
    env.close()


def test_a_snapped_mask_drops_out_and_comes_back_as_it_was():
    env = FR5GraspEnv(scene_set="val", mask_dropout=0.5, mask_snap=True)
    env.reset(seed=1)
    shown = [env.mask.pixels]
    for _ in range(12):
        env.step(env.holding_action())
        shown.append(env.mask.pixels)
    env.close()
    whole = [pixels for pixels in shown if pixels.any()]
    assert 0 < len(whole) < len(shown)
    assert all(np.array_equal(pixels, whole[0]) for pixels in whole)


class Wrong:
    """A segmenter that marks a square, wherever it is asked."""

    def __init__(self, rows, columns):
        self._marked = np.zeros((384, 512), dtype=bool)
        self._marked[rows, columns] = True

    def pixels(self, picture, row, column):
        return self._marked


@pytest.mark.parametrize(
    "wrong",
    [Wrong(slice(0), slice(0)), Wrong(slice(0, 30), slice(0, 30)), Wrong(slice(0, 384), slice(0, 512))],
    ids=["nothing", "elsewhere", "everything"],
)
def test_a_mask_under_which_nothing_like_it_is_found_stays_and_says_so(wrong):
    env = FR5GraspEnv(scene_set="val")
    env.reset(seed=1)
    corrupted = CorruptedSource(OracleSource(), condition="correct", noise="none", noise_px=0)
    source = SnappedSource(corrupted)
    source._snapper._clicks._segmenter = wrong
    mask = source.mask(env, env.command)
    assert np.array_equal(mask.pixels, env.mask.pixels)
    assert mask.parameters["snap"] == "nothing like it there"
    env.close()


def test_the_masks_of_any_source_are_snapped_and_nothing_stays_nothing(right):
    env = FR5GraspEnv(scene_set="val")
    env.reset(seed=0)

    class Beside:
        moved = 4

        def mask(self, view, command):
            shown = OracleSource().mask(view, command)
            return None if self.moved is None else replace(shown, pixels=np.roll(shown.pixels, self.moved, axis=1))

    source = Beside()
    snapped = SnappedMasks(source).mask(env, env.command)
    assert overlap(snapped.pixels[None], right[:1]) > 0.8
    assert snapped.parameters["snap"] == "snapped"
    source.moved = None
    assert SnappedMasks(source).mask(env, env.command) is None
    env.close()
