"""The loose soil of one `Soil`: builds what parcels need from tool, fields and box, and steps them."""

import math

import numpy as np

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.arrays import Array, Flags
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.container import Container
from lerobot_excav.envs.soil.fidelity import Fidelity
from lerobot_excav.envs.soil.height_field import Grid, HeightField
from lerobot_excav.envs.soil.motion import Pose, largest_motion, path
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.dynamics import Laws
from lerobot_excav.envs.soil.parcels.ground import Site, places_below
from lerobot_excav.envs.soil.parcels.plates import NO_BOX, BoxWalls, ToolPath
from lerobot_excav.envs.soil.parcels.population import Landed, Population
from lerobot_excav.envs.soil.parcels.store import WALLS
from lerobot_excav.envs.soil.tool import ToolGeometry

_PHASE_PER_SUBSTEP = 0.2
"""Phase of a parcel on its contact spring per sub-step [rad] (tuned: stable up to a dozen contacts)."""

_FARTHEST = 0.2
"""Motion of the bucket per sub-step, in radii, that no parcel can be overrun by."""

_NO_PLACE: Array = np.zeros((2, 3))
_NO_TURN: Array = np.stack([np.eye(3), np.eye(3)])


def _laws(parameters: SoilParameters, fidelity: Fidelity, mass_kg: float) -> Laws:
    """Return the coefficients of the contacts; the stiffness is the highest that the sub-steps resolve."""
    stiffness = mass_kg * (_PHASE_PER_SUBSTEP * fidelity.substeps_per_tick / TICK_S) ** 2
    p, tan = parameters, parameters.slope_tan
    rolling = p.parcel_rolling_scale * tan
    ground = (p.ground_sliding_scale * tan, p.ground_rolling_scale * tan)
    return Laws(
        parcel=Law(stiffness, p.parcel_sliding_scale * tan, rolling),
        ground=Law(stiffness, *ground),
        steel=Law(stiffness, math.tan(p.steel_friction_angle_rad), rolling),
    )


@kernel
def _pile_up(heights: Array, grid: Grid, positions: Array, masses: Array, load: Flags, density: float) -> None:
    """Add parcels (n,) outside of the bucket to the columns (nx, ny) [m] that they are over, as in the ground."""
    nx, ny = heights.shape
    half_x, half_y = 0.5 * nx * grid.dx, 0.5 * ny * grid.dy
    for k in range(len(masses)):
        x, y = positions[k, 0], positions[k, 1]
        if load[k] or not (abs(x) < half_x and abs(y) < half_y):
            continue
        i = min(max(round((x - grid.x0) / grid.dx), 0), nx - 1)
        j = min(max(round((y - grid.y0) / grid.dy), 0), ny - 1)
        heights[i, j] += masses[k] / density / (grid.dx * grid.dy)


def _box_walls(container: Container | None, floor_depth_m: float) -> BoxWalls:
    if container is None:
        return NO_BOX
    x, y, z = (float(v) for v in container.center_w)
    z += floor_depth_m
    cos, sin = (float(v) for v in container.axes_w[0])
    half_x, half_y = (float(v) for v in container.half_extent_m)
    return BoxWalls(x, y, z, half_x, half_y, z + container.wall_height_m, cos, sin)


class LooseSoil:
    """Parcels of one soil and their surroundings: dig area, soil in the target box, the box if there is one.

    Attributes:
        population: All parcels; z counts from the rigid floor.
        whole_kg: Mass of a whole parcel.
    """

    def __init__(
        self,
        parameters: SoilParameters,
        fidelity: Fidelity,
        field: HeightField,
        box_field: HeightField,
        container: Container | None,
        floor_depth_m: float,
    ) -> None:
        self.whole_kg = parameters.parcel_mass_kg(fidelity.parcel_radius_m)
        self._fidelity = fidelity
        self._field, self._box_field = field, box_field
        self._container = container
        self._box = _box_walls(container, floor_depth_m)
        self._level_z = floor_depth_m
        self._density_kg_m3 = parameters.density_kg_m3
        self._swell = parameters.swell
        laws = _laws(parameters, fidelity, self.whole_kg)
        self.population = Population(WALLS + 3, laws, fidelity.parcel_radius_m, self.whole_kg, fidelity.most_awake)
        self.clear()

    def clear(self) -> None:
        """Remove all parcels and forget the bucket."""
        self.population.clear()
        self._tool = ToolPath(0, np.zeros((2, 2)), np.zeros((4, 4)), 0.0, _NO_PLACE, _NO_TURN, np.zeros(3), np.zeros(3))

    def add(self, positions: Array, velocities: Array, masses_kg: Array, *, apart: bool) -> float:
        """Add parcels as `Population.add` does; what finds no room lands at once on what is below it.

        Returns the mass [kg] that landed out of bounds.
        """
        left = self.population.add(positions, velocities, masses_kg, apart=apart)
        if not left.any():
            return 0.0
        points = np.ascontiguousarray(positions[left, :2])
        place = places_below(self._site(), points)
        return self._merge(Landed(points_w=points, masses_kg=masses_kg[left], place=place))

    def step(
        self, geometry: ToolGeometry | None, before: Pose | None, now: Pose | None, dt_s: float, *, cutting: bool
    ) -> float:
        """Move the parcels along with the bucket, if there is one, and let those at rest become ground.

        Cutting: soil entered it in this step. Returns the mass [kg] that landed out of bounds.
        """
        if geometry is None or now is None:
            tool = self._without_tool(dt_s)
        else:
            tool = self._with_tool(geometry, now if before is None else before, now, dt_s)
        self._tool = tool
        self.population.allow_plates(len(tool.profile) + 1 + WALLS)
        site = self._site()
        self.population.step(tool, site, dt_s, cutting=cutting)
        return self._merge(self.population.settle(site, dt_s))

    def lay_down(self) -> float:
        """Turn all parcels into ground, each on what is below it; return the mass [kg] that landed out of bounds."""
        state = self.population.state
        points, masses = np.ascontiguousarray(state.positions[:, :2]), state.masses.copy()
        landed = Landed(points_w=points, masses_kg=masses, place=places_below(self._site(), points))
        self.population.clear()
        return self._merge(landed)

    def weighed_heights(self) -> Array:
        """Return (nx, ny) heights of the dig area [m] with the parcels outside of the bucket put on their columns."""
        state, field = self.population.state, self._field
        if state.load.all():
            return field.heights
        heights = field.heights.copy()
        _pile_up(heights, field.grid, state.positions, state.masses, state.load, self._density_kg_m3)
        return heights

    def _steps(self, dt_s: float) -> int:
        return max(1, math.ceil(self._fidelity.substeps_per_tick * dt_s / TICK_S - 1e-9))

    def _with_tool(self, geometry: ToolGeometry, before: Pose, now: Pose, dt_s: float) -> ToolPath:
        moved = largest_motion(geometry.corners_t, before, now)
        farthest = _FARTHEST * self._fidelity.parcel_radius_m
        steps = max(self._steps(dt_s), math.ceil(moved / farthest))
        positions, rotations, turn = path(before, now, steps)
        shape = geometry.profile_t, geometry.planes_t, 0.5 * float(geometry.inner_width_m)
        velocities = (now.position - before.position) / dt_s, turn / dt_s
        return ToolPath(1, *shape, positions, rotations, *velocities)

    def _without_tool(self, dt_s: float) -> ToolPath:
        """Return the path of no bucket; a load stays asleep in the one that went away."""
        if self._tool.present:
            self.population.freeze_load(self._tool)
        steps = self._steps(dt_s)
        nowhere = np.repeat(self._tool.positions[-1:], steps + 1, axis=0)
        unturned = np.repeat(self._tool.rotations[-1:], steps + 1, axis=0)
        return self._tool._replace(present=0, positions=nowhere, rotations=unturned)

    def _site(self) -> Site:
        field, inside = self._field, self._box_field
        return Site(field.heights, field.grid, inside.heights, inside.grid, self._box, self._level_z)

    def _merge(self, landed: Landed) -> float:
        """Put landed parcels on the fields; return the mass [kg] that belongs to neither."""
        if len(landed.masses_kg) == 0:
            return 0.0
        volumes = landed.masses_kg / self._density_kg_m3 * self._swell
        on_ground, in_box = landed.is_on_ground, landed.is_in_box
        if on_ground.any():
            self._field.deposit(landed.points_w[on_ground], volumes[on_ground])
        if self._container is not None and in_box.any():
            self._box_field.deposit(self._container.to_local(landed.points_w[in_box]), volumes[in_box])
        return float(landed.masses_kg[~on_ground & ~in_box].sum())
