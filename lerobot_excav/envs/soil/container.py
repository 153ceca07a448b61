"""The target box: a rigid, open container beside the dig area."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.errors import require


@dataclass(frozen=True, kw_only=True, eq=False)
class Container:
    """An open rectangular box with thin, rigid walls.

    Attributes:
        center_w: (3,) centre of its floor [m].
        half_extent_m: (2,) half of its inner length and width, along its own x and y [m].
        wall_height_m: Height of the walls above its floor.
        yaw_rad: Rotation about z, counter-clockwise from above.

    Raises:
        ConfigurationError: A length is not positive or a value is not finite.
    """

    center_w: Array
    half_extent_m: Array
    wall_height_m: float
    yaw_rad: float

    def __post_init__(self) -> None:
        for name, size in (("center_w", 3), ("half_extent_m", 2)):
            value = np.array(getattr(self, name), dtype=np.float64)
            require(
                value.shape == (size,) and bool(np.isfinite(value).all()),
                f"container {name}={value.tolist()}; allowed: {size} finite numbers.",
            )
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        require(
            bool((self.half_extent_m > 0).all()), f"container half_extent_m={self.half_extent_m}; allowed: above 0."
        )
        require(
            0 < self.wall_height_m < math.inf,
            f"container wall_height_m={self.wall_height_m!r}; allowed: above 0 and finite.",
        )
        require(math.isfinite(self.yaw_rad), f"container yaw_rad={self.yaw_rad!r}; allowed: a finite angle.")

    @cached_property
    def axes_w(self) -> Array:
        """Return (2, 2) whose rows are the container's x and y axes in the world plane."""
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return np.array([[cos, sin], [-sin, cos]])

    def to_local(self, xy_w: Array) -> Array:
        """Turn world points (..., 2) into the container's own plane, origin at its centre [m]."""
        return np.asarray((xy_w - self.center_w[:2]) @ self.axes_w.T, dtype=np.float64)

    def overlaps(self, extent_m: tuple[float, float]) -> bool:
        """Tell whether the footprint overlaps a rectangle of this extent, centred at the world origin."""
        half = 0.5 * np.asarray(extent_m)
        axes = self.axes_w
        signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
        own = self.center_w[:2] + (signs * self.half_extent_m) @ axes
        other = signs * half
        for axis in (*axes, *np.eye(2)):  # separating axes of two rectangles
            a, b = own @ axis, other @ axis
            if a.max() <= b.min() + 1e-9 or b.max() <= a.min() + 1e-9:
                return False
        return True
