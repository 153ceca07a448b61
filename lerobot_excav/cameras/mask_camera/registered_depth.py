"""The depth image of a real camera, as mask sources look at it."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lerobot_excav.errors import ConfigurationError, DeviceError

SPECKLE_PX = 3.0
"""A hole no pixel of which lies farther from a measured one than this is filled from there [px] (kind: guess): stereo
cameras lose single pixels on smooth sand, and a mask full of holes is none that a policy has seen."""


def registered_depth_m(
    depth: NDArray[np.uint16], picture: NDArray[np.uint8], *, camera: str, unit_m: float
) -> NDArray[np.float32]:
    """Return the depth (H, W) [m] of a picture (H, W, 3), NaN where nothing was measured.

    Args:
        depth: What LeRobot's cameras give, (H, W, 1), 0 where nothing was measured.
        picture: What the same camera shows; pixel for pixel the same view.
        camera: Its name.
        unit_m: Unit of the depth [m].

    Raises:
        DeviceError: Nothing was measured.
        ConfigurationError: Depth has another size than the picture, so that it does not lie on it.
    """
    measured = depth[..., 0]
    size = picture.shape[:2]
    if measured.shape != size:
        raise ConfigurationError(
            f"the depth image of {camera!r} is {measured.shape}, its pictures are {size} (height, width): depth has to "
            "be registered with them, pixel by pixel; give both the same size"
        )
    if not measured.any():
        raise DeviceError(f"the depth image of {camera!r} is empty: nothing was measured; look at the camera")
    is_hole = measured == 0
    away_px, nearest = ndimage.distance_transform_edt(is_hole, return_indices=True)
    holes, count = ndimage.label(is_hole)
    widest_px = np.append(0.0, ndimage.maximum(away_px, holes, np.arange(1, count + 1)))[holes]
    depth_m: NDArray[np.float32] = measured[tuple(nearest)].astype(np.float32) * np.float32(unit_m)
    depth_m[widest_px > SPECKLE_PX] = np.nan
    return depth_m
