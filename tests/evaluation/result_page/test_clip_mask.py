import numpy as np
import pytest

from lerobot_excav.evaluation.result_page.clip_mask import shown_masks

SIZE = {"height": 96, "width": 128}


@pytest.fixture
def masks(make_run, grasp_line):
    """Draw the masks of an episode in scene 7 with target 3."""

    def draw(**changes):
        run = make_run("a", [grasp_line(7, **changes)])
        return shown_masks(run, run.keys[0], **SIZE)

    return draw


def test_the_mask_of_an_episode_is_drawn_again(masks):
    (mask,) = masks()
    assert mask.since == 0
    assert mask.pixels.shape == (96, 128)
    assert 20 < mask.pixels.sum() < 200


def test_conditions_and_noise_are_those_of_the_run(masks):
    (correct,), (zero,), (other,) = masks(), masks(mask_condition="zero"), masks(mask_condition="mismatched")
    assert not zero.pixels.any()
    assert other.pixels.any()
    assert not (other.pixels & correct.pixels).any()
    (grown,) = masks(mask_noise="dilate", mask_noise_px=2)
    assert grown.pixels.sum() > correct.pixels.sum()
    assert (grown.pixels & correct.pixels).sum() == correct.pixels.sum()


def test_after_a_change_of_the_command_the_new_block_is_marked(masks):
    first, second = masks(commands=[[0, 3], [25, 1]])
    assert (first.since, second.since) == (0, 25)
    assert np.array_equal(first.pixels, masks()[0].pixels)
    assert not (first.pixels & second.pixels).any()
