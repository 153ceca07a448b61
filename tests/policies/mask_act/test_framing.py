"""Pictures of any size: cropped and resized within the policy, the mask with them."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.framing import framed

from .conftest import CAB, HEIGHT, MAIN, MASK, WIDTH, make_batch, make_config, make_policy, square_mask, visual


def views_and_mask(height=HEIGHT, width=WIDTH, top=8, left=16, size=12):
    mask = torch.zeros(2, 1, height, width)
    mask[:, :, top : top + size, left : left + size] = 1.0
    rgb = torch.rand(2, 3, height, width, generator=torch.Generator().manual_seed(0))
    return [rgb, 1.0 - rgb], mask


def test_without_settings_everything_stays():
    views, mask = views_and_mask()
    new, new_mask = framed(views, mask, main=1, crop=None, resize_to=None)
    assert all(a is b for a, b in zip(new, views, strict=True))
    assert new_mask is mask


def test_a_crop_takes_the_same_part_of_picture_and_mask_and_leaves_other_views():
    views, mask = views_and_mask()
    new, new_mask = framed(views, mask, main=1, crop=(4, 8, 20, 32), resize_to=None)
    assert torch.equal(new[0], views[0])
    assert torch.equal(new[1], views[1][..., 4:24, 8:40])
    assert torch.equal(new_mask, mask[..., 4:24, 8:40])


def test_resizing_halves_a_target_and_keeps_its_place():
    views, mask = views_and_mask()
    new, new_mask = framed(views, mask, main=1, crop=None, resize_to=(HEIGHT // 2, WIDTH // 2))
    expected = torch.zeros(2, 1, HEIGHT // 2, WIDTH // 2)
    expected[:, :, 4:10, 8:14] = 1.0
    assert torch.equal(new_mask, expected)
    means = views[1].mean(dim=(2, 3))
    torch.testing.assert_close(new[1].mean(dim=(2, 3)), means, atol=0.02, rtol=0.0)


@given(st.integers(0, 46), st.integers(0, 62), st.integers(1, 2))
def test_a_target_is_never_lost_by_resizing(top, left, size):
    views, mask = views_and_mask(48, 64, top, left, size)
    _, new_mask = framed(views, mask, main=1, crop=None, resize_to=(16, 16))
    assert new_mask.flatten(1).any(dim=1).all()
    assert set(new_mask.unique().tolist()) <= {0.0, 1.0}
    rows, columns = torch.nonzero(new_mask[0, 0], as_tuple=True)
    assert abs(float(rows.float().mean()) + 0.5 - (top + size / 2) / 3) <= 1.0
    assert abs(float(columns.float().mean()) + 0.5 - (left + size / 2) / 4) <= 1.0


def test_an_empty_mask_stays_empty():
    views, mask = views_and_mask(size=0)
    _, new_mask = framed(views, mask, main=1, crop=(0, 0, 20, 20), resize_to=(16, 16))
    assert not new_mask.any()


def test_a_crop_without_the_target_is_an_error():
    views, mask = views_and_mask()
    with pytest.raises(ConfigurationError, match="leaves nothing of a target mask"):
        framed(views, mask, main=1, crop=(0, 0, 8, 48), resize_to=None)


def test_a_policy_sees_large_pictures_at_the_size_that_it_is_told():
    features = {**make_config().input_features}
    features |= {MAIN: visual(3, 4 * HEIGHT, 4 * WIDTH), MASK: visual(3, 4 * HEIGHT, 4 * WIDTH)}
    policy = make_policy(input_features=features, resize_to=[HEIGHT, WIDTH], target_token=True)
    batch = make_batch()
    large = {**batch, MAIN: batch[MAIN].repeat_interleave(4, 2).repeat_interleave(4, 3)}
    large[MASK] = batch[MASK].repeat_interleave(4, 2).repeat_interleave(4, 3)
    plans = policy.predict_action_chunk(large)
    small = make_policy(target_token=True)
    small.load_state_dict(policy.state_dict())
    reference = small.predict_action_chunk(batch)
    assert plans.shape == reference.shape
    # Enlarged pixel by pixel and averaged again, a picture is hardly another one.
    assert (plans - reference).abs().mean() < 0.3 * reference.std()


def test_the_crop_moves_what_the_policy_plans_with_the_target():
    policy = make_policy(crop=[0, 0, 32, 32], resize_to=[32, 48], target_token=True)
    batch = make_batch()
    moved = {**batch, MASK: square_mask(3, top=12, left=2)}
    assert not torch.allclose(policy.predict_action_chunk(batch), policy.predict_action_chunk(moved))
    assert CAB in batch


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"resize_to": [96]}, r"policy\.resize_to=\[96\]"),
        ({"resize_to": [8, 96]}, r"policy\.resize_to=\[8, 96\]"),
        ({"crop": [0, 0, 8, 32]}, r"policy\.crop=\[0, 0, 8, 32\]"),
        ({"crop": [0, 0, 32]}, r"policy\.crop=\[0, 0, 32\]"),
        ({"crop": [8, 0, 32, 32]}, "leads out of the main camera"),
    ],
)
def test_what_is_not_possible_is_refused(settings, words):
    with pytest.raises(ConfigurationError, match=words):
        make_policy(**settings)
