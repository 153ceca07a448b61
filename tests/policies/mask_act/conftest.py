"""A tiny policy and batches for it."""

import pytest
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from torch import nn

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"
STATE = "observation.state"
HEIGHT, WIDTH, CHUNK = 32, 48, 8
BACKBONES = ("resnet_small", "resnet18")


def visual(*shape):
    return PolicyFeature(type=FeatureType.VISUAL, shape=shape)


INPUT_FEATURES = {
    **dict.fromkeys((MAIN, CAB, MASK), visual(3, HEIGHT, WIDTH)),
    STATE: PolicyFeature(type=FeatureType.STATE, shape=(8,)),
}
OUTPUT_FEATURES = {"action": PolicyFeature(type=FeatureType.ACTION, shape=(4,))}

TINY = {
    **{"preset": "fast", "chunk_size": CHUNK, "device": "cpu", "push_to_hub": False},
    **{"dim_model": 32, "dim_feedforward": 48, "n_heads": 4, "n_encoder_layers": 1},
}


def make_config(**settings):
    features = {"input_features": dict(INPUT_FEATURES), "output_features": dict(OUTPUT_FEATURES)}
    return MaskACTConfig(**{**TINY, **features, **settings})


def make_policy(*, seed=0, **settings):
    torch.manual_seed(seed)
    return MaskACTPolicy(make_config(**settings)).eval()


def stem(network):
    """The first convolution, which reads the mask."""
    return next(m for m in network.modules() if isinstance(m, nn.Conv2d))


def make_batch(batch_size=3, *, seed=0, actions=False):
    generator = torch.Generator().manual_seed(seed)
    batch = {key: torch.rand(batch_size, *ft.shape, generator=generator) for key, ft in INPUT_FEATURES.items()}
    batch[MASK] = square_mask(batch_size, top=8, left=16)
    if actions:
        batch["action"] = torch.randn(batch_size, CHUNK, 4, generator=generator)
        batch["action_is_pad"] = torch.zeros(batch_size, CHUNK, dtype=torch.bool)
    return batch


def square_mask(batch_size, *, top, left, size=12):
    mask = torch.zeros(batch_size, 3, HEIGHT, WIDTH)
    mask[:, :, top : top + size, left : left + size] = 1.0
    return mask


config = pytest.fixture(lambda: make_config)
policy = pytest.fixture(lambda: make_policy)
batch = pytest.fixture(lambda: make_batch)
mask = pytest.fixture(lambda: square_mask)


@pytest.fixture
def awake():
    """A policy whose stem has weights for the mask, as training would give it."""

    def build(**settings):
        agent = make_policy(**settings)
        weights = torch.randn(stem(agent).weight[:, 3].shape, generator=torch.Generator().manual_seed(5))
        with torch.no_grad():
            stem(agent).weight[:, 3] = weights
        return agent

    return build
