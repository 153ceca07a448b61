"""Settings of `--policy.type=mask_act` on what it reads: the mask, and the pictures that belong to it."""

from dataclasses import dataclass

from lerobot_excav.policies.mask_act.mask_shape import MASK_SHAPES, POINT_PX
from lerobot_excav.setting import setting

TARGET_MASK_KEY = "observation.images.target_mask"
MAIN_CAMERA_KEY = "observation.images.main"
"""Camera that the mask belongs to where a policy has one of this name and none is chosen."""

HOLD_FRAMES = 20
"""For how long the last mask is used where the next ones are empty [frames] (kind: guess: of masks of which half are
missing, no more than one in a million is the last of so many; on the excavator it is 2 s)."""


@dataclass
class MaskInput:
    """What a policy reads of mask and pictures, and how both are changed before the network sees them."""

    mask_key: str = setting(
        "Image feature of the target mask, {0, 255}, of the size of the main camera", default=TARGET_MASK_KEY
    )
    main_camera: str | None = setting(
        f"Image feature that the mask belongs to; left out: {MAIN_CAMERA_KEY}, or the only camera of the mask's size",
        default=None,
    )
    withhold_mask: bool = setting("Silence every path of the mask: the no-condition variant", default=False)
    withhold_pictures: bool = setting(
        "Silence the colours of every camera: the policy acts on mask and state alone", default=False
    )
    mask_shape: str = setting(
        f"What the network sees of the mask: region, every pixel; box, its bounding box, filled; point, {POINT_PX} x "
        f"{POINT_PX} pixels at its middle. For sources that give no more than a box or a click",
        default="region",
        choices=MASK_SHAPES,
    )
    target_token: bool = setting("Add one token pooled under the mask, placed to the pixel", default=False)
    coordinate_channels: bool = setting(
        "Show the backbone the row and column of every pixel as two more channels, so that the plain fourth channel "
        "can tell where it lies",
        default=False,
    )
    hold_mask_frames: int = setting(
        "While the mask is empty, act on the last one that was not, for so many frames in a row at most; 0 acts on "
        "empty masks, which show no target [frames]",
        default=HOLD_FRAMES,
        low=0,
        high=10_000,
    )
    replan_iou: float = setting(
        "Keep a plan while the mask overlaps with the one it was made for by at least this much (intersection over "
        "union); 1 plans again at every pixel that changes. For long plans and masks that flicker",
        default=1.0,
        above=0.0,
        high=1.0,
    )
    crop: list[int] | None = setting(
        "Top, left, height and width of the part of the main picture and its mask that is used [px]; left out: all",
        default=None,
        low=0,
        high=4096,
    )
    resize_to: list[int] | None = setting(
        "Height and width to which all pictures and the mask are brought [px]; left out: they stay",
        default=None,
        low=0,
        high=4096,
    )
    augment_shift_px: int = setting(
        "In training, move the main picture and its mask together by up to this much along each axis, drawn for each "
        "sample; other views stay [px]",
        default=0,
        low=0,
        high=1024,
        hint="0 leaves pictures where they are.",
    )
    augment_mask_px: int = setting(
        "In training, move the mask alone by up to this much along each axis, drawn for each sample: the policy learns "
        "to forgive masks that lie beside their target [px of the dataset's pictures]",
        default=0,
        low=0,
        high=1024,
        hint="0 leaves masks where they are.",
    )
    compare_masks: bool = setting(
        "In training, compare masks with the stored frames; turn it off only if a processor of your own moves pictures "
        "and masks together",
        default=True,
    )
