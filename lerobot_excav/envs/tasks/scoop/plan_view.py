"""The worksite from above: heights as colours, the regions, the bucket."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.masks.overlay import TINT_RGB
from lerobot_excav.envs.tasks.scoop.targets import Target

PIXELS_PER_M = 40
HIGHEST_M = 1.0
"""Height with the last colour [m]; piles of `train` reach 1.1 m (kind: guess)."""

# From bare ground over sand to the crest (kind: tuned by eye); monotonous in lightness, so it reads without colours.
_COLOURS = np.array([(38, 42, 50), (92, 78, 62), (156, 124, 78), (214, 178, 110), (250, 232, 178)], np.float64)
_REGION_RGB, _BUCKET_RGB, _REACH_RGB = (235, 235, 235), (255, 190, 40), (90, 96, 106)
_BUCKET_PX = 4


def draw_plan(worksite: Worksite, targets: Mapping[int, Target], commanded: int) -> NDArray[np.uint8]:
    """Return the map of the dig area, (H, W, 3) uint8: the machine stands at its lower edge and looks up.

    Regions are squares, the commanded one in the colour of the mask; a ring stands for the middle of the cutting edge.
    """
    image = Image.fromarray(_heights(worksite))
    draw = ImageDraw.Draw(image)
    for number, target in targets.items():
        corners = [tuple(_pixel(corner_w)) for corner_w in target.corners_w]
        is_it = number == commanded
        draw.polygon(corners, outline=TINT_RGB if is_it else _REGION_RGB, width=3 if is_it else 1)
    x, y = _pixel(worksite.machine.cutting_edge_pos_w[:2])
    draw.ellipse((x - _BUCKET_PX, y - _BUCKET_PX, x + _BUCKET_PX, y + _BUCKET_PX), outline=_BUCKET_RGB, width=2)
    draw.line((tuple(_pixel(np.asarray(MACHINE_POS_W[:2]))), (x, y)), fill=_REACH_RGB)
    return np.asarray(image)


def height_colours(heights_m: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return heights of any shape (...) [m] as colours, (..., 3) uint8: the higher, the lighter."""
    share = np.clip(heights_m / HIGHEST_M, 0.0, 1.0) * (len(_COLOURS) - 1)
    low = np.minimum(share.astype(int), len(_COLOURS) - 2)
    part = (share - low)[..., None]
    return np.asarray((1.0 - part) * _COLOURS[low] + part * _COLOURS[low + 1]).astype(np.uint8)


def _heights(worksite: Worksite) -> NDArray[np.uint8]:
    """Return the heights as colours, turned so that the machine's forward axis points up and its left is left."""
    colours = height_colours(worksite.soil.heights_m)
    height, width = (round(PIXELS_PER_M * extent) for extent in DIG_AREA_EXTENT_M)
    turned = colours[::-1, ::-1]  # rows along x, columns along y, both from the far end
    return np.asarray(Image.fromarray(np.ascontiguousarray(turned)).resize((width, height), Image.Resampling.BILINEAR))


def _pixel(point_w: NDArray[np.float64]) -> tuple[float, float]:
    """Return column and row of a point (2,) [m]."""
    half_x, half_y = 0.5 * np.asarray(DIG_AREA_EXTENT_M)
    return float(PIXELS_PER_M * (half_y - point_w[1])), float(PIXELS_PER_M * (half_x - point_w[0]))
