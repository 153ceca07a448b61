"""The depth image of a real camera, as mask sources look at it."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lerobot_excav.errors import ConfigurationError, DeviceError

SPECKLE_PX = 3.0
"""How far a pixel that was not measured may lie from one that was, whose depth it takes [px] (kind: guess): stereo
cameras lose single pixels on smooth sand, and a mask full of holes is none that a policy has seen."""


def registered_depth_m(depth_mm: NDArray[np.uint16], picture: NDArray[np.uint8], camera: str) -> NDArray[np.float32]:
    """Return the depth (H, W) [m] of a picture (H, W, 3), NaN where nothing was measured.

    Args:
        depth_mm: What LeRobot's cameras give, (H, W, 1) [mm], 0 where nothing was measured.
        picture: What the same camera shows; pixel for pixel the same view.
        camera: Its name.

    Raises:
        DeviceError: Nothing was measured.
        ConfigurationError: Depth has another size than the picture, so that it does not lie on it.
    """
    measured = depth_mm[..., 0]
    size = picture.shape[:2]
    if measured.shape != size:
        raise ConfigurationError(
            f"the depth image of {camera!r} is {measured.shape}, its pictures are {size} (height, width): depth has to "
            "be registered with them, pixel by pixel"
        )
    if not measured.any():
        raise DeviceError(f"the depth image of {camera!r} is empty: nothing was measured; look at the camera")
    away_px, nearest = ndimage.distance_transform_edt(measured == 0, return_indices=True)
    depth_m: NDArray[np.float32] = measured[tuple(nearest)].astype(np.float32) * np.float32(1e-3)
    depth_m[away_px > SPECKLE_PX] = np.nan
    return depth_m
