"""The shape in which a mask reaches the network: as it is, as a box, or as a point."""

import torch
from torch import Tensor

MASK_SHAPES = ("region", "box", "point")
"""`region`: every pixel of the mask; `box`: its bounding box, filled; `point`: a square at the mean of its pixels."""

POINT_PX = 3
"""Side of that square [px] (kind: guess: one pixel could vanish between the strides of a backbone)."""


def shaped(mask: Tensor, shape: str) -> Tensor:
    """Return masks in one of `MASK_SHAPES`; what comes from a box or a click by itself has that shape already.

    Args:
        mask: Target masks, 0 or 1, (B, 1, H, W); an empty one stays empty.
        shape: Its new shape.

    Returns:
        Masks, 0 or 1, (B, 1, H, W); for `region` the given ones.
    """
    if shape == "region":
        return mask
    rows, columns = mask.amax(dim=3, keepdim=True), mask.amax(dim=2, keepdim=True)  # (B, 1, H, 1), (B, 1, 1, W)
    if shape == "box":
        return _between(rows, dim=2) * _between(columns, dim=3)
    has_target = rows.amax(dim=2, keepdim=True)
    return has_target * _around_mean(mask, dim=2) * _around_mean(mask, dim=3)


def _between(marked: Tensor, dim: int) -> Tensor:
    """Fill an axis from its first to its last marked entry."""
    after_first = marked.cummax(dim).values
    before_last = marked.flip(dim).cummax(dim).values.flip(dim)
    return after_first * before_last


def _around_mean(mask: Tensor, dim: int) -> Tensor:
    """Mark the entries of an axis that are at most half a point from the mean of the mask's pixels.

    A mean between two entries goes to the higher one, so that a mask that moves by a pixel moves its point by a pixel.
    """
    others = 5 - dim
    counts = mask.sum(dim=others, keepdim=True)  # mask pixels for each entry of the axis
    shape = [-1 if axis == dim else 1 for axis in range(4)]
    places = torch.arange(mask.shape[dim], dtype=mask.dtype, device=mask.device).reshape(shape)
    mean = (counts * places).sum(dim=dim, keepdim=True) / counts.sum(dim=dim, keepdim=True).clamp_min(1)
    return ((places - (mean + 0.5).floor()).abs() <= POINT_PX // 2).to(mask.dtype)
