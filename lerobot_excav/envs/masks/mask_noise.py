"""Mask noise: errors that a segmentation makes, by the pixel."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.settings import MASK_NOISES
from lerobot_excav.errors import require_choice


def noisy_mask(
    mask: NDArray[np.uint8], noise: str, size_px: int, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return a mask with the error of an imperfect segmentation.

    Args:
        mask: Right mask (H, W, 3) of {0, 255}, uint8.
        noise: `none`; `shift` (moved by `size_px` in a random direction, kept inside the picture); `erode` (without the
            pixels within `size_px` of its outside, city-block distance; nothing may be left); `dilate` (with them).
        size_px: Size of the error [px].
        rng: Source of the direction.

    Returns:
        Mask (H, W, 3) of {0, 255}, uint8.

    Raises:
        ConfigurationError: There is no such noise.
    """
    require_choice("mask_noise", noise, MASK_NOISES)
    if noise == "none" or not mask.any():
        return mask.copy()
    inside = mask[..., 0] > 0
    if noise == "shift":
        inside = _shifted(inside, size_px, rng)
    else:
        # Eroding the mask is dilating its outside; beyond the picture's edge lies neither.
        grown = inside if noise == "dilate" else ~inside
        for _ in range(size_px):
            grown = _grown(grown)
        inside = grown if noise == "dilate" else ~grown
    return np.repeat(np.where(inside, 255, 0).astype(np.uint8)[..., None], 3, axis=-1)


def _shifted(inside: NDArray[np.bool_], size_px: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Move a blob in a random direction, as far as the picture goes."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    rows, cols = np.nonzero(inside)
    height, width = inside.shape
    row_shift = np.clip(round(size_px * np.sin(angle)), -rows.min(), height - 1 - rows.max())
    col_shift = np.clip(round(size_px * np.cos(angle)), -cols.min(), width - 1 - cols.max())
    moved = np.zeros_like(inside)
    moved[rows + row_shift, cols + col_shift] = True
    return moved


def _grown(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Add the four neighbours of every pixel."""
    grown = inside.copy()
    grown[1:] |= inside[:-1]
    grown[:-1] |= inside[1:]
    grown[:, 1:] |= inside[:, :-1]
    grown[:, :-1] |= inside[:, 1:]
    return grown
