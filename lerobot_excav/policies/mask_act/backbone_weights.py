"""Pretrained weights of backbones, by name."""


def known_weights(backbone: str) -> list[str]:
    """Return the names of torchvision's weights for a backbone, as its functions take them."""
    if backbone == "resnet_small":
        return []
    from torchvision.models import get_model_weights  # slow to import, and asked for by few

    kind = get_model_weights(backbone)
    return [f"{prefix}{name}" for prefix in (f"{kind.__name__}.", "") for name in kind.__members__]
