"""Augmentation that moves a picture and its mask together."""

import torch
from torch import Tensor


def shift_together(picture: Tensor, mask: Tensor, shift_px: int) -> tuple[Tensor, Tensor]:
    """Move every picture and its mask by the same whole number of pixels, drawn for each sample and axis.

    What comes in at the border repeats the picture's edge, and is no target. The draw comes from PyTorch's global
    generator on the CPU, which `lerobot-train --seed` sets.

    Args:
        picture: Pictures, shape (B, C, H, W).
        mask: Their masks, shape (B, 1, H, W).
        shift_px: Greatest shift along each axis; all shifts from -shift_px to shift_px are equally likely.

    Returns:
        Moved picture and mask, new tensors.
    """
    moved, was_inside = shifted(torch.cat([picture, mask], dim=1), shift_px)
    return moved[:, :-1], moved[:, -1:] * was_inside


def shifted(pixels: Tensor, shift_px: int) -> tuple[Tensor, Tensor]:
    """Move every stack of channels (B, C, H, W) by a whole number of pixels, drawn for each sample and axis.

    Returns:
        The moved stacks, whose edges are repeated, and which of their pixels come from inside, bool (B, 1, H, W).
    """
    size, _, height, width = pixels.shape
    down, right = torch.randint(-shift_px, shift_px + 1, (2, size, 1)).to(pixels.device)
    rows = torch.arange(height, device=pixels.device) - down  # (B, H): where each row comes from
    columns = torch.arange(width, device=pixels.device) - right
    sample = torch.arange(size, device=pixels.device)[:, None, None]
    source = (rows.clamp(0, height - 1)[:, :, None], columns.clamp(0, width - 1)[:, None, :])
    moved = pixels[sample, :, *source].permute(0, 3, 1, 2)
    return moved, is_in(rows, height)[:, None, :, None] & is_in(columns, width)[:, None, None, :]


def is_in(number: Tensor, count: int) -> Tensor:
    """Return which numbers of rows or columns exist, of `count`."""
    return (number >= 0) & (number < count)
