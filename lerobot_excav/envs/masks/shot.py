"""A sharp picture of the main view: what detectors and segmenters look at, whatever size policies see."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.errors import require

ENLARGED = 4
"""How many times sharper than the policy's picture a simulator draws it (kind: measured: a colour segmenter reaches an
IoU of 1.0 on blocks at 384 x 512, and 0.66 at 96 x 128)."""


@dataclass(frozen=True, kw_only=True)
class Shot:
    """A picture, and what was measured with it.

    Attributes:
        picture: (H, W, 3) uint8.
        depth_m: (H, W) float32, distance along the optical axis [m]; None without a depth camera.
        camera: Where the camera stood, and how it projects; None if nobody has calibrated it.
    """

    picture: NDArray[np.uint8]
    depth_m: NDArray[np.float32] | None = None
    camera: PinholeCamera | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Height and width [px]."""
        height, width = self.picture.shape[:2]
        return height, width

    def points_w(self) -> NDArray[np.float64]:
        """Return the world points (H, W, 3) [m] that the pixels show.

        Raises:
            ConfigurationError: There is no depth, or the camera is not calibrated.
        """
        require(self.depth_m is not None, "this picture has no depth; use a depth camera, or another mask source")
        require(self.camera is not None, "this camera is not calibrated; use another mask source")
        assert self.depth_m is not None  # or it was refused
        assert self.camera is not None
        return self.camera.points_w(self.depth_m)


def reduced(pixels: NDArray[np.bool_], size: tuple[int, int], *, covered: float = 0.5) -> NDArray[np.bool_]:
    """Return a mask (H, W) at the size (h, w) of another picture of the same view.

    A pixel is in it if more than the share `covered` of its area is.
    """
    height, width = size
    along = _overlap(pixels.shape[0], height) @ pixels.astype(np.float64) @ _overlap(pixels.shape[1], width).T
    return np.asarray(along > covered)


def _overlap(fine: int, coarse: int) -> NDArray[np.float64]:
    """Return which share of each coarse cell each fine cell covers, (coarse, fine)."""
    edges_fine, edges_coarse = np.linspace(0.0, 1.0, fine + 1), np.linspace(0.0, 1.0, coarse + 1)
    low = np.maximum(edges_coarse[:-1, None], edges_fine[None, :-1])
    high = np.minimum(edges_coarse[1:, None], edges_fine[None, 1:])
    return np.asarray(np.maximum(high - low, 0.0) * coarse)
