"""A tiny policy and batches for it."""

from collections.abc import Callable
from typing import Any

import pytest
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from torch import Tensor, nn

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"
STATE = "observation.state"
HEIGHT, WIDTH, CHUNK = 32, 48, 8
BACKBONES = ("resnet_small", "resnet18")


def visual(*shape: int) -> PolicyFeature:
    return PolicyFeature(type=FeatureType.VISUAL, shape=shape)


INPUT_FEATURES = {
    **dict.fromkeys((MAIN, CAB, MASK), visual(3, HEIGHT, WIDTH)),
    STATE: PolicyFeature(type=FeatureType.STATE, shape=(8,)),
}
OUTPUT_FEATURES = {"action": PolicyFeature(type=FeatureType.ACTION, shape=(4,))}

TINY: dict[str, Any] = {
    **{"preset": "fast", "chunk_size": CHUNK, "device": "cpu", "push_to_hub": False},
    **{"dim_model": 32, "dim_feedforward": 48, "n_heads": 4, "n_encoder_layers": 1},
}


def make_config(**settings: Any) -> MaskACTConfig:
    features = {"input_features": dict(INPUT_FEATURES), "output_features": dict(OUTPUT_FEATURES)}
    return MaskACTConfig(**{**TINY, **features, **settings})


def make_policy(*, seed: int = 0, **settings: Any) -> MaskACTPolicy:
    torch.manual_seed(seed)
    return MaskACTPolicy(make_config(**settings)).eval()


def stem(network: nn.Module) -> nn.Conv2d:
    """The first convolution, which reads the mask."""
    return next(m for m in network.modules() if isinstance(m, nn.Conv2d))


def make_batch(batch_size: int = 3, *, seed: int = 0, actions: bool = False) -> dict[str, Any]:
    generator = torch.Generator().manual_seed(seed)
    batch: dict[str, Any] = {
        key: torch.rand(batch_size, *feature.shape, generator=generator) for key, feature in INPUT_FEATURES.items()
    }
    batch[MASK] = square_mask(batch_size, top=8, left=16)
    if actions:
        batch["action"] = torch.randn(batch_size, CHUNK, 4, generator=generator)
        batch["action_is_pad"] = torch.zeros(batch_size, CHUNK, dtype=torch.bool)
    return batch


def square_mask(batch_size: int, *, top: int, left: int, size: int = 12) -> Tensor:
    mask = torch.zeros(batch_size, 3, HEIGHT, WIDTH)
    mask[:, :, top : top + size, left : left + size] = 1.0
    return mask


@pytest.fixture
def config() -> Callable[..., MaskACTConfig]:
    return make_config


@pytest.fixture
def policy() -> Callable[..., MaskACTPolicy]:
    return make_policy


@pytest.fixture
def awake() -> Callable[..., MaskACTPolicy]:
    """A policy whose stem has weights for the mask, as training would give it."""

    def build(**settings: Any) -> MaskACTPolicy:
        agent = make_policy(**settings)
        weights = torch.randn(stem(agent).weight[:, 3].shape, generator=torch.Generator().manual_seed(5))
        with torch.no_grad():
            stem(agent).weight[:, 3] = weights
        return agent

    return build


@pytest.fixture
def batch() -> Callable[..., dict[str, Any]]:
    return make_batch


@pytest.fixture
def mask() -> Callable[..., Tensor]:
    return square_mask
