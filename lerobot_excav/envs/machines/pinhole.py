"""Cameras without a simulator: where they stand, and how they project."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class CameraPose(NamedTuple):
    """Where a camera stands and what it looks at; its upper edge points up.

    Attributes:
        position: Eye point (3,) [m], in the frame of the body that carries the camera.
        target: A point on the optical axis (3,) [m], same frame.
        fovy_deg: Vertical field of view [degrees].
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    fovy_deg: float

    @property
    def axes(self) -> NDArray[np.float64]:
        """Rotation (3, 3) whose columns are the camera's right, up and backward axes."""
        backward = np.subtract(self.position, self.target)
        backward = backward / np.linalg.norm(backward)
        right = np.cross((0.0, 0.0, 1.0), backward)
        right = right / np.linalg.norm(right)
        return np.column_stack([right, np.cross(backward, right), backward])


@dataclass(frozen=True, kw_only=True)
class PinholeCamera:
    """An ideal camera with square pixels whose optical axis meets the middle of the picture.

    Attributes:
        position_w: Eye point [m], (3,), world frame.
        axes_w: Rotation (3, 3) whose columns are its right, up and backward axes.
        fovy_rad: Vertical field of view [rad].
        height: Image height H [px].
        width: Image width W [px].
    """

    position_w: NDArray[np.float64]
    axes_w: NDArray[np.float64]
    fovy_rad: float
    height: int
    width: int

    def pixel(self, point_w: NDArray[np.float64]) -> tuple[float, float] | None:
        """Return row and column at which a world point (3,) [m] is seen, pixel centres being whole numbers.

        None stands for a point behind the camera; others may lie beside the picture.
        """
        right, up, backward = (point_w - self.position_w) @ self.axes_w
        if backward >= 0.0:
            return None
        focal_px = 0.5 * self.height / np.tan(0.5 * self.fovy_rad)
        row, column = 0.5 * self.height + focal_px * up / backward, 0.5 * self.width - focal_px * right / backward
        return float(row) - 0.5, float(column) - 0.5

    def points_w(self, depth_m: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the world points (H, W, 3) [m] behind the pixels, at distances (H, W) [m] along the optical axis."""
        focal_px = 0.5 * self.height / np.tan(0.5 * self.fovy_rad)
        row, column = np.indices(depth_m.shape)
        right = (column + 0.5 - 0.5 * self.width) / focal_px
        up = (0.5 * self.height - row - 0.5) / focal_px
        rays = np.stack([right, up, -np.ones_like(right)], axis=-1)
        return np.asarray(self.position_w + (depth_m[..., None] * rays) @ self.axes_w.T)
