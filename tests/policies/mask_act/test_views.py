import pytest
import torch

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.views import masked_views, target_mask

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"


def test_mask_is_binarised_at_one_half(config, batch):
    observation = batch(1)
    observation[MASK] = torch.full_like(observation[MASK], 0.5)
    observation[MASK][..., 0, 0] = 0.51
    observation[MASK][..., 0, 1] = 0.49
    mask = target_mask(config(), observation)
    assert mask.sum() == 1
    assert mask[0, 0, 0, 0] == 1


@pytest.mark.parametrize(
    "convert", [lambda m: m[:, :1], lambda m: (m * 255).to(torch.uint8), lambda m: m.bool()]
)
def test_one_channel_bytes_and_booleans_are_the_same_mask(config, batch, convert):
    observation = batch()
    expected = target_mask(config(), observation)
    mask = target_mask(config(), {**observation, MASK: convert(observation[MASK])})
    assert mask.dtype == torch.float32
    assert torch.equal(mask, expected)


def test_mask_joins_the_main_camera_and_zeros_the_others(config, batch):
    observation, settings = batch(), config(main_camera=CAB)
    mask = target_mask(settings, observation)
    main, cab = masked_views(settings, observation, mask)
    assert torch.equal(cab[:, 3:], mask)
    assert mask.any()
    assert not main[:, 3].any()
    assert torch.equal(main[:, :3], observation[MAIN])


def test_a_withheld_mask_is_zero_and_needs_no_feature(config, batch):
    observation = batch()
    assert not target_mask(config(withhold_mask=True), observation).any()
    del observation[MASK]
    assert not target_mask(config(withhold_mask=True), observation).any()


def test_a_missing_mask_is_named_with_what_to_do(config, batch):
    observation = batch()
    del observation[MASK]
    with pytest.raises(ConfigurationError, match=r"no 'observation.images.target_mask'.*withhold_mask=true"):
        target_mask(config(), observation)


def test_a_mask_of_another_size_is_refused(config, batch):
    observation = batch()
    observation[MASK] = observation[MASK][..., :-1]
    with pytest.raises(ConfigurationError, match=r"target_mask is 32 x 47.*main is 32 x 48"):
        target_mask(config(), observation)


def test_cameras_that_do_not_match_are_named_on_both_sides(config, batch):
    observation = batch()
    observation["observation.images.top"] = observation.pop(CAB)
    with pytest.raises(ConfigurationError, match=r"cab.*main.*main.*top.*missing.*cab"):
        target_mask(config(), observation)


def test_a_camera_of_another_size_is_refused(config, batch):
    observation = batch()
    observation[CAB] = observation[CAB][..., :16, :]
    with pytest.raises(ConfigurationError, match=r"cab has shape \(3, 16, 48\).*\(3, 32, 48\)"):
        target_mask(config(), observation)
