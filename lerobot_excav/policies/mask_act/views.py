"""Four-channel views: RGB of each camera, joined with the target mask or with zeros."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from lerobot_excav.errors import require
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.features import MISSING_MASK_HINT, require_mask_shape

Batch = dict[str, Any]


def target_mask(config: MaskACTConfig, batch: Batch, *, is_training: bool = False) -> Tensor:
    """Return the binary target mask, the only place where the policy reads it.

    Args:
        config: Settings of the policy; with `withhold_mask` the mask is zero and the batch needs none.
        batch: Observations: the mask, shape (B, 1 or 3, H, W), and the main camera.
        is_training: Whether the mask may come from a lossy video, which moves its values: it is cut at one half.
            Otherwise it must hold 0 and 1 only, or 0 and 255.

    Returns:
        Mask, 0 or 1, float, shape (B, 1, H, W).

    Raises:
        ConfigurationError: The batch has no main camera or no mask, their sizes differ, or the mask is not binary.
    """
    require_cameras(config, batch)
    main: Tensor = batch[config.main_camera_key]
    if config.withhold_mask:
        return torch.zeros_like(main[:, :1])
    require(
        config.mask_key in batch,
        f"the observations have no {config.mask_key!r}; they have {image_keys(batch)}. {MISSING_MASK_HINT}",
    )
    mask: Tensor = batch[config.mask_key]
    require_mask_shape(config.mask_key, tuple(mask.shape), config.main_camera_key, tuple(main.shape))
    if not is_training:
        require_binary(config.mask_key, mask)
    return (mask[:, :1] > 0.5).to(main.dtype)  # of three equal channels the first


def require_binary(mask_key: str, mask: Tensor) -> None:
    """Raise `ConfigurationError` unless a mask holds 0 and 1 only, or 0 and 255. All zeros are a mask, too."""
    others = mask[(mask != 0) & (mask != 1) & (mask != 255)]
    require(
        others.numel() == 0,
        f"{mask_key} holds values such as {others[:1].tolist()} and is not binary; allowed: 0 outside the target and 1 "
        "(or 255) on it. If these are probabilities or a lossy video, pass mask > 0.5.",
    )


def pictures(config: MaskACTConfig, batch: Batch) -> list[Tensor]:
    """Return RGB, (B, 3, H, W), of each of `config.camera_keys`; the mean colour if `withhold_pictures`."""
    given: list[Tensor] = [batch[key] for key in config.camera_keys]
    return [torch.zeros_like(rgb) for rgb in given] if config.withhold_pictures else given


def masked_views(rgb: Sequence[Tensor], mask: Tensor, main: int) -> list[Tensor]:
    """Join the mask to the main picture, the one of this index, and zeros to every other: each (B, 4, H, W)."""
    fourth = [mask if index == main else torch.zeros_like(picture[:, :1]) for index, picture in enumerate(rgb)]
    return [torch.cat(pair, dim=1) for pair in zip(rgb, fourth, strict=True)]


def require_cameras(config: MaskACTConfig, batch: Batch) -> None:
    """Raise `ConfigurationError` unless a batch holds every camera of the policy at the size it was built for."""
    given = [key for key in image_keys(batch) if key != config.mask_key]
    missing = [key for key in config.camera_keys if key not in batch]
    require(
        not missing,
        f"the cameras do not match: the policy reads {sorted(config.camera_keys)}, the observations have "
        f"{given}; missing: {missing}. Use the environment, robot or dataset of the training data, or "
        "--rename_map.",
    )
    for key in config.camera_keys:
        expected, shape = tuple(config.image_features[key].shape), tuple(batch[key].shape[1:])
        require(
            shape == expected,
            f"{key} has shape {shape}, the policy was built for {expected} (channels, height, width); set the "
            "environment's observation_height and observation_width, or train at this size.",
        )


def image_keys(batch: Batch) -> list[str]:
    """Return the names of the images in a batch, sorted."""
    return sorted(key for key in batch if key.startswith("observation.image"))
