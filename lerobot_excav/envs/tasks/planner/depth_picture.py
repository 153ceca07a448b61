"""Depth as a picture that people and models can look at."""

import numpy as np
from numpy.typing import NDArray

NEAREST, FARTHEST = 2.0, 98.0
"""Percentiles of the depth that become white and black (kind: guess)."""


def depth_picture(depth_m: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return a depth image (H, W) [m] as grey levels, (H, W, 3) uint8: the lighter, the nearer.

    What was not measured, NaN, is black.
    """
    near_m, far_m = np.nanpercentile(depth_m, [NEAREST, FARTHEST])
    share = np.nan_to_num(np.clip((far_m - depth_m) / max(float(far_m - near_m), 1e-6), 0.0, 1.0))
    return np.repeat((255.0 * share).astype(np.uint8)[..., None], 3, axis=-1)
