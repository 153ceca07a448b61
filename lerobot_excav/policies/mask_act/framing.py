"""Cropping and resizing of pictures within the policy, so that a camera's own size works; the mask goes along."""

from collections.abc import Sequence

from torch import Tensor
from torch.nn import functional

from lerobot_excav.errors import require

SMALLEST_PX = 16
"""Least height and width of what the network sees [px] (kind: derived: one cell of the feature map, and a little)."""


def framed(
    pictures: Sequence[Tensor], mask: Tensor, *, main: int, crop: Sequence[int] | None, resize_to: Sequence[int] | None
) -> tuple[list[Tensor], Tensor]:
    """Crop the main picture and its mask, and bring all pictures and the mask to a size.

    Pixels are averaged; a target is never lost, however small it becomes: a pixel is in the mask if the target covers
    more than half as much of it as of the pixel that it covers most.

    Args:
        pictures: RGB of each camera, (B, 3, H, W).
        mask: Target mask of the main one, 0 or 1, (B, 1, H, W).
        main: Index of the main picture.
        crop: Top, left, height and width of the part of the main picture that is used [px]; None is all of it.
        resize_to: Height and width [px]; None leaves sizes as they are.

    Returns:
        The pictures and the mask.

    Raises:
        ConfigurationError: Nothing of a target is left after the crop: the policy would act without one.
    """
    new = list(pictures)
    if crop is not None:
        top, left, height, width = crop
        part = slice(top, top + height), slice(left, left + width)
        cut = mask[..., part[0], part[1]]
        lost = mask.flatten(1).any(dim=1) & ~cut.flatten(1).any(dim=1)
        require(
            not bool(lost.any()),
            f"policy.crop={list(crop)} leaves nothing of a target mask, so the policy had none to act on; crop less",
        )
        new[main], mask = new[main][..., part[0], part[1]], cut
    if resize_to is None:
        return new, mask
    size = (int(resize_to[0]), int(resize_to[1]))
    return [_resized(picture, size) for picture in new], _resized_mask(mask, size)


def require_framing(
    crop: Sequence[int] | None, resize_to: Sequence[int] | None, main_shape: tuple[int, ...] | None
) -> None:
    """Check the settings of cropping and resizing, against the shape (3, H, W) of the main camera if it is known.

    Raises:
        ConfigurationError: They have not the right number of values, lead out of the picture, or make it too small.
    """
    require(
        resize_to is None or (len(resize_to) == 2 and min(resize_to) >= SMALLEST_PX),
        f"policy.resize_to={resize_to} is not possible; give height and width from {SMALLEST_PX} on, such as [96,128].",
    )
    if crop is None:
        return
    require(
        len(crop) == 4 and min(crop[2:]) >= SMALLEST_PX,
        f"policy.crop={crop} is not possible; give top, left, height and width, the last two from {SMALLEST_PX} on, "
        "such as [0,80,480,480].",
    )
    if main_shape is not None:
        top, left, height, width = crop
        require(
            top + height <= main_shape[1] and left + width <= main_shape[2],
            f"policy.crop={crop} leads out of the main camera of shape {main_shape}; allowed: top + height up "
            f"to {main_shape[1]}, left + width up to {main_shape[2]}.",
        )


def _resized(picture: Tensor, size: tuple[int, int]) -> Tensor:
    return functional.interpolate(picture, size, mode="bilinear", antialias=True, align_corners=False)


def _resized_mask(mask: Tensor, size: tuple[int, int]) -> Tensor:
    covered = functional.interpolate(mask, size, mode="area")
    most = covered.amax(dim=(1, 2, 3), keepdim=True)
    return ((covered > 0.5 * most) & (most > 0.0)).to(mask.dtype)
