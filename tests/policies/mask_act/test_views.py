import pytest
import torch

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.views import masked_views, pictures, target_mask

from .conftest import CAB, MAIN, MASK


@pytest.mark.parametrize(
    "convert", [lambda m: m[:, :1], lambda m: (m * 255).to(torch.uint8), lambda m: m * 255, lambda m: m.bool()]
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
    main, cab = masked_views(pictures(settings, observation), mask, main=settings.camera_keys.index(CAB))
    assert torch.equal(cab[:, 3:], mask)
    assert mask.any()
    assert not main[:, 3].any()
    assert torch.equal(main[:, :3], observation[MAIN])


def test_missing_pictures_are_named_with_what_to_do(config, batch):
    observation = batch()
    mask = observation.pop(MASK)
    with pytest.raises(ConfigurationError, match=r"no 'observation.images.target_mask'.*withhold_mask=true"):
        target_mask(config(), observation)
    observation |= {MASK: mask, "observation.images.top": observation.pop(CAB)}
    with pytest.raises(ConfigurationError, match=r"cab.*main.*main.*top.*missing.*cab"):
        target_mask(config(), observation)


@pytest.mark.parametrize(
    ("key", "change", "message"),
    [
        (MASK, lambda m: m[..., :-1], r"target_mask has shape \(3, 3, 32, 47\).*main has shape \(3, 3, 32, 48\)"),
        (MASK, lambda m: m[:, 0], r"shape \(3, 32, 48\).*must be \(3, 1, 32, 48\) or \(3, 3, 32, 48\)"),
        (MASK, lambda m: m[:, :2], r"shape \(3, 2, 32, 48\)"),
        (MASK, lambda m: m[:1], r"shape \(1, 3, 32, 48\)"),
        (MASK, lambda m: m * 0.7, r"values such as \[0\.6.*not binary; allowed: 0 .* and 1 \(or 255\).*> 0\.5"),
        (CAB, lambda c: c[..., :16, :], r"cab has shape \(3, 16, 48\).*\(3, 32, 48\)"),
    ],
)
def test_a_picture_that_does_not_fit_is_refused(config, batch, key, change, message):
    observation = batch()
    observation[key] = change(observation[key])
    with pytest.raises(ConfigurationError, match=message):
        target_mask(config(), observation)
