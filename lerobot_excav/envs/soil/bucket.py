"""The bucket in the soil: where it was, what it cuts, what enters it."""

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.random import Generator

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.cutting import cut, set_ceiling
from lerobot_excav.envs.soil.fidelity import Fidelity
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.layer import Window
from lerobot_excav.envs.soil.motion import Pose, largest_motion, poses_between
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.soil.parcels.birth import Intake
from lerobot_excav.envs.soil.tool import Tool, ToolGeometry
from lerobot_excav.errors import require

LARGEST_MOTION_M = 1.0
"""Motion per step above which the tool must have been placed by hand: 50 m/s at a tick of 0.02 s."""

FILLING_UP = 0.1
"""Around its heaped volume, over this share of it, a bucket goes from taking all that meets the opening to taking none:
were it full at once, the heap ahead and the force would jump (guess)."""

_NO_WINDOW = Window(0, 0, 0, 0)


@lru_cache(maxsize=4)
def heaped_volume_m3(geometry: ToolGeometry, slope_tan: float) -> float:
    """Return the volume [m3] of a level bucket with a heap: struck volume and a hip roof over the opening.

    A roof that rises with `slope_tan` from all four sides of a rectangle a <= b has the volume
    slope_tan (a^2 b / 4 - a^3 / 12); at 1 it is the heap of SAE J296.
    """
    length = float(np.linalg.norm(geometry.profile_t[0] - geometry.profile_t[-1]))
    a, b = sorted((length, float(geometry.inner_width_m)))
    return geometry.struck_volume_m3 + slope_tan * (a**2 * b / 4 - a**3 / 12)


def _checked_motion(geometry: ToolGeometry, before: Pose | None, now: Pose) -> float:
    """Return how far the tool moved [m]; refuse a motion that no machine makes within a step."""
    moved = 0.0 if before is None else largest_motion(geometry.corners_t, before, now)
    require(
        moved <= LARGEST_MOTION_M,
        f"tool moved {moved:.3g} m in one step; allowed: {LARGEST_MOTION_M} m. "
        "After placing the machine by hand, reset the soil or step once with tool=None.",
    )
    return moved


def _window(geometry: ToolGeometry, pose: Pose, field: HeightField) -> Window:
    """Return the columns whose lines may be inside of the bucket: these stand up to half a cell from the middle."""
    return field.window(pose.place(geometry.corners_t), (0.5 * field.grid.dx, 0.5 * field.grid.dy))


class Bucket:
    """One tool at work in a height field.

    Attributes:
        pose: Where it was in the last step; None if it was not there.
        intake: Soil that has entered it and is not yet a parcel; None before any tool was seen.
    """

    def __init__(self, parameters: SoilParameters, fidelity: Fidelity) -> None:
        """Start without a tool."""
        self._parameters = parameters
        self._fidelity = fidelity
        self.clear()

    def clear(self) -> None:
        """Forget the tool."""
        self.pose: Pose | None = None
        self.intake: Intake | None = None
        self._window = _NO_WINDOW

    def leave(self, field: HeightField) -> None:
        """Take note that the tool is gone; what waits to become parcels stays in it."""
        if self.pose is None:
            return
        self.pose = None
        self._window = _NO_WINDOW
        field.uncover()

    @property
    def waiting_m3(self) -> float:
        """Volume that has entered and is not yet a parcel [m3]."""
        return 0.0 if self.intake is None else self.intake.waiting_m3

    def move(self, tool: Tool, field: HeightField, floor_depth_m: float, load_m3: float) -> tuple[float, float]:
        """Sweep the bucket from its last pose to this one.

        It takes in soil up to about its heaped volume, `load_m3` of it being there already (as in the ground), and
        pushes the rest ahead; the field changes in place. A tool that was not there in the last step cuts nothing.

        Returns the volumes [m3] that entered and that were pushed over the border.

        Raises:
            ConfigurationError: The tool jumped by more than `LARGEST_MOTION_M`.
        """
        pose = Pose.of(tool, floor_depth_m)
        geometry = tool.geometry
        motion_m = _checked_motion(geometry, self.pose, pose)
        before, self.pose = self.pose, pose
        if self.intake is None or not self.intake.geometry.has_shape_of(geometry):
            waiting_m3 = self.waiting_m3
            self.intake = Intake(geometry, self._fidelity.parcel_radius_m)
            self.intake.bins.volumes[0, 0] = waiting_m3
        volumes_m3, window = (0.0, 0.0), _window(geometry, pose, field)
        if before is not None:
            most = heaped_volume_m3(geometry, self._parameters.slope_tan) / self._parameters.swell
            room = max(0.0, (1.0 + 0.5 * FILLING_UP) * most - load_m3 - self.waiting_m3), FILLING_UP * most
            steps = max(1, math.ceil(motion_m / (self._fidelity.substep_cells * min(field.grid.cell_m))))
            path = poses_between(before, pose, steps)
            volumes_m3 = self._sweep(geometry, path, window, field, self.intake, room)
        self._cover(geometry, pose, window, field)
        return volumes_m3

    def births(self, *, all_of_it: bool, rng: Generator) -> tuple[Array, Array]:
        """Turn what waits into parcels; all of it: the rest that is less than a parcel too.

        Returns (n, 3) positions in the tool frame [m] and (n,) masses [kg].
        """
        if self.intake is None or self.intake.waiting_m3 <= 0.0:
            return np.zeros((0, 3)), np.zeros(0)
        whole_kg = self._parameters.parcel_mass_kg(self._fidelity.parcel_radius_m)
        density = self._parameters.density_kg_m3
        points: Array = self.intake.births(whole_kg / density, rng)
        masses: Array = np.full(len(points), whole_kg)
        rest_kg = self.intake.waiting_m3 * density
        if all_of_it and rest_kg > 0.0:
            self.intake.clear()
            points = np.concatenate([points, self.intake.geometry.centroid_t[None]])
            masses = np.append(masses, rest_kg)
        return points, masses

    def _sweep(
        self,
        geometry: ToolGeometry,
        path: Iterator[tuple[Pose, Pose]],
        last_window: Window,
        field: HeightField,
        intake: Intake,
        room: tuple[float, float],
    ) -> tuple[float, float]:
        (most, fade), entered, lost = room, 0.0, 0.0
        for start, end in path:
            window = last_window if end is self.pose else _window(geometry, end, field)
            motion = geometry.planes_t, start, end, window
            intaking = self._fidelity.vertical_bins, max(0.0, most - entered), fade, intake.bins
            more, over = cut(
                field.heights, field.layer.firm, self._parameters.swell, field.active, field.grid, *motion, *intaking
            )
            entered += more
            lost += over
        return entered, lost

    def _cover(self, geometry: ToolGeometry, pose: Pose, window: Window, field: HeightField) -> None:
        """Let the underside of the bucket, which is inside of a window, hold avalanches back."""
        area = window.union(self._window)
        set_ceiling(field.heights, field.active, field.ceiling, field.grid, geometry.planes_t, pose, area)
        field.wake()
        self._window = window
