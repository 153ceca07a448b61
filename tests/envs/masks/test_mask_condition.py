import numpy as np
import pytest

from lerobot_excav.envs.masks.mask_condition import conditioned_mask, corruption_rng
from lerobot_excav.envs.tasks.settings import MASK_CONDITIONS
from lerobot_excav.errors import ConfigurationError, ExcavError


@pytest.fixture
def masks():
    images = np.zeros((4, 40, 60, 3), dtype=np.uint8)
    for i in range(4):
        images[i, 5 + 2 * i : 12 + 2 * i, 4 + 12 * i : 13 + 12 * i] = 255
    return list(images)


def test_correct_shows_the_target_and_leaves_the_original_alone(masks, rng):
    shown = conditioned_mask(masks, 2, "correct", rng)
    assert np.array_equal(shown, masks[2])
    assert not np.shares_memory(shown, masks[2])


def test_zero_shows_nothing(masks, rng):
    assert conditioned_mask(masks, 2, "zero", rng).max() == 0


@pytest.mark.parametrize("target_id", range(4))
def test_random_shows_a_blob_of_the_same_size_off_its_place(masks, rng, target_id):
    for _ in range(20):
        shown = conditioned_mask(masks, target_id, "random", rng)
        assert shown.sum() == masks[target_id].sum()
        assert not np.any(shown & masks[target_id])


@pytest.mark.parametrize("target_id", range(4))
def test_mismatched_shows_another_target_and_in_time_every_other(masks, rng, target_id):
    shown = {conditioned_mask(masks, target_id, "mismatched", rng).tobytes() for _ in range(60)}
    assert shown == {masks[i].tobytes() for i in range(4) if i != target_id}


def test_unknown_condition_is_refused(masks, rng):
    with pytest.raises(ConfigurationError, match=r"mask_condition='none'.*'mismatched'"):
        conditioned_mask(masks, 2, "none", rng)


@pytest.mark.parametrize("condition", MASK_CONDITIONS)
def test_target_without_a_pixel_is_refused(masks, rng, condition):
    masks[1][:] = 0
    with pytest.raises(ExcavError, match=r"target_id=1 .*40 x 60.*observation_height"):
        conditioned_mask(masks, 1, condition, rng)


def test_blob_too_large_to_move_says_what_to_change(rng):
    with pytest.raises(ExcavError, match="observation_height"):
        conditioned_mask([np.full((20, 20, 3), 255, dtype=np.uint8)], 0, "random", rng)


def test_corruption_repeats_for_a_scene_and_target_and_differs_elsewhere():
    def draw(*place):
        return corruption_rng(*place).random(4).tolist()

    places = [("train", 3, 1), ("test", 3, 1), ("train", 4, 1), ("train", 3, 2)]
    assert draw(*places[0]) == draw(*places[0])
    assert len({tuple(draw(*place)) for place in places}) == len(places)
