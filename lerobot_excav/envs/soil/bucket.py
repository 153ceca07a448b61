"""The bucket in the soil: where it was, what it cuts, what it holds."""

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from lerobot_excav.envs.soil.capacity import Capacity, Load
from lerobot_excav.envs.soil.cutting import Window, cut, set_ceiling
from lerobot_excav.envs.soil.fidelity import Fidelity
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.motion import Pose, largest_motion, poses_between
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.soil.parcels import Parcels
from lerobot_excav.envs.soil.spilling import (
    buried_share,
    opening_ends,
    overflow_volume,
    pour,
    return_to_ground,
)
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.errors import require

Array = NDArray[np.float64]

LARGEST_MOTION_M = 1.0
"""Motion per step above which the tool must have been placed by hand: 50 m/s at a tick of 0.02 s."""

_NO_WINDOW: Window = (0, 0, 0, 0)


def _union(a: Window, b: Window) -> Window:
    """Return the smallest window that holds both; an empty one does not count."""
    if a[1] <= a[0] or a[3] <= a[2]:
        return b
    if b[1] <= b[0] or b[3] <= b[2]:
        return a
    return min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])


class Bucket:
    """Bookkeeping of one tool.

    Volumes are volumes in the ground; in the bucket the soil takes `swell` times as much room.

    Attributes:
        payload_m3: Volume of the soil held [m3].
        load: How it lies in the bucket; None before any tool was seen.
    """

    def __init__(self, parameters: SoilParameters, fidelity: Fidelity) -> None:
        """Start without a tool and without a payload."""
        self._parameters = parameters
        self._fidelity = fidelity
        self.clear()

    def clear(self) -> None:
        """Empty the bucket and forget the tool."""
        self.payload_m3 = 0.0
        self.load: Load | None = None
        self._pose: Pose | None = None
        self._window = _NO_WINDOW
        self._capacity: Capacity | None = None
        self._support = 0.0

    def leave(self, field: HeightField) -> None:
        """Take note that the tool is gone; what it held stays in the bucket."""
        if self._pose is None:
            return
        self._pose = None
        self._window = _NO_WINDOW
        field.uncover()

    def move(self, tool: Tool, field: HeightField, floor_depth_m: float) -> float:
        """Sweep the bucket from its last pose to this one; return the volume [m3] pushed over the border.

        A tool that was not there in the last step cuts nothing.

        Raises:
            ConfigurationError: The tool jumped by more than `LARGEST_MOTION_M`.
        """
        pose = Pose.of(tool, floor_depth_m)
        before, self._pose = self._pose, pose
        if self._capacity is None or self._capacity.geometry is not tool.geometry:
            self._capacity = Capacity(tool.geometry, self._parameters.slope_tan)
        lower, upper = opening_ends(tool)
        self._support = buried_share(
            field.heights, field.grid, *pose.arrays, (*lower, *upper), tool.geometry.inner_width_m
        )
        lost = 0.0 if before is None else self._sweep(tool, before, pose, field)
        self._cover(tool.geometry, pose, field)
        return lost

    def spill(self, tool: Tool, field: HeightField, parcels: Parcels, dt_s: float, rng: Generator) -> float:
        """Let the excess leave at a finite rate; return the volume [m3] pushed over the border.

        Before a buried edge it goes back to the ground, else it becomes parcels.
        """
        volume = overflow_volume(self._parameters, self.payload_m3, self._retained_volume(tool), dt_s)
        lost = 0.0
        if volume > 0.0:
            self.payload_m3 = max(0.0, self.payload_m3 - volume)
            if self._support > 0.0 and self._pose is not None:
                lost = return_to_ground(tool.geometry, self._pose, field, opening_ends(tool)[0], volume)
            else:
                mass_kg = volume * self._parameters.density_kg_m3
                pour(tool, parcels, mass_kg, self._parameters.parcel_mass_kg, dt_s, rng)
        self._settle(tool)
        return lost

    def _retained_volume(self, tool: Tool) -> float:
        if self._capacity is None:
            return 0.0
        return self._capacity.retained_volume(tool.pitch_rad, self._support) / self._parameters.swell

    def _settle(self, tool: Tool) -> None:
        """Work out how the payload lies."""
        if self._capacity is not None:
            self.load = self._capacity.load(
                self.payload_m3 * self._parameters.swell, tool.pitch_rad, self._support
            )

    def _sweep(self, tool: Tool, before: Pose, now: Pose, field: HeightField) -> float:
        geometry = tool.geometry
        moved = largest_motion(geometry.corners_t, before, now)
        require(
            moved <= LARGEST_MOTION_M,
            f"tool moved {moved:.3g} m in one step; allowed: {LARGEST_MOTION_M} m. "
            "After placing the machine by hand, reset the soil or step once with tool=None.",
        )
        steps = max(1, math.ceil(moved / (self._fidelity.substep_cells * min(field.grid[2:]))))
        retained = self._retained_volume(tool)
        lost = 0.0
        for start, end in poses_between(before, now, steps):
            entered, over = cut(
                field.heights,
                field.active,
                field.grid,
                geometry.planes_t,
                start.arrays,
                end.arrays,
                field.window(end.place(geometry.corners_t)),
                self._fidelity.vertical_bins,
                max(0.0, retained - self.payload_m3),
            )
            self.payload_m3 += entered
            lost += over
        return lost

    def _cover(self, geometry: ToolGeometry, pose: Pose, field: HeightField) -> None:
        """Let the underside of the bucket hold avalanches back."""
        window = field.window(pose.place(geometry.corners_t))
        set_ceiling(
            field.heights,
            field.active,
            field.ceiling,
            field.grid,
            geometry.planes_t,
            *pose.arrays,
            _union(window, self._window),
        )
        field.wake()
        self._window = window
