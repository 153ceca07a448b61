"""Augmentation that moves a mask alone: the error of whoever points."""

from collections.abc import Sequence

import torch
from torch import Tensor

from lerobot_excav.policies.mask_act.picture_shift import shifted


def shift_alone(mask: Tensor, shift_px: int, crop: Sequence[int] | None = None) -> Tensor:
    """Move every mask by a whole number of pixels, drawn for each sample and axis; its picture stays.

    A mask that would leave the picture, or its crop, stays where it is: nothing would say where to act. The draw comes
    from PyTorch's global generator on the CPU, which `lerobot-train --seed` sets.

    Args:
        mask: Masks, shape (B, 1, H, W).
        shift_px: Greatest shift along each axis; all shifts from -shift_px to shift_px are equally likely.

        crop: Top, left, height and width of the part that is used; None for all.

    Returns:
        Moved masks, a new tensor.
    """
    shifted_mask, was_inside = shifted(mask, shift_px)
    moved, (height, width) = shifted_mask * was_inside, mask.shape[-2:]
    top, left, used_height, used_width = crop or (0, 0, height, width)
    used = moved[:, :, top : top + used_height, left : left + used_width]
    is_left = used.flatten(1).any(dim=1)[:, None, None, None]
    return torch.where(is_left, moved, mask)
