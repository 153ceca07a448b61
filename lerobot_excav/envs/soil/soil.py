"""The soil: one class that owns every kilogram and steps it."""

import math

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.arrays import Array, Bools
from lerobot_excav.envs.soil.bucket import Bucket
from lerobot_excav.envs.soil.container import Container
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.forces import SoilResistance
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.loose import LooseSoil
from lerobot_excav.envs.soil.parameters import PRESETS, SoilParameters
from lerobot_excav.envs.soil.tool import Reaction, Tool
from lerobot_excav.errors import ConfigurationError, require, require_choice


def _whole_cells(length_m: float, cell_size_m: float, field: str) -> int:
    """Return how many cells make a length; it must be a whole number."""
    require(
        0 < length_m < math.inf and 0 < cell_size_m < math.inf,
        f"{field}={length_m!r}, cell_size_m={cell_size_m!r}; allowed: above 0 and finite.",
    )
    count = round(length_m / cell_size_m)
    require(
        count >= 2 and abs(count * cell_size_m - length_m) < 1e-6,
        f"{field}={length_m!r} is not a whole number (2 or more) of cells of cell_size_m={cell_size_m!r}; "
        "change one of the two.",
    )
    return count


class Soil:
    """Deformable soil on a rigid floor, loose parcels, a bucket's load and soil in a target box.

    World frame: origin at the centre of the extent, z up. Heights count from the rigid floor, which lies
    `floor_depth_m` below z = 0. Around the extent the ground is level at z = 0; soil that gets there is out of
    bounds. Every kilogram is in one entry of `ledger_kg`, whose sum no step changes.

    Args:
        preset: Name of the soil, one of `PRESETS`, or parameters of one's own.
        extent_m: Size of the dig area along x and y; a whole number of cells.
        cell_size_m: Size of a column.
        fidelity: Numerical effort, one of `FIDELITIES`.
        seed: Seed of the offsets of new parcels; `reset` starts it again.
        container: Target box outside of the dig area, or None.
        floor_depth_m: Depth of the rigid floor below z = 0.

    Raises:
        ConfigurationError: An argument has a value that cannot be used.
    """

    def __init__(
        self,
        preset: str | SoilParameters = "sand",
        extent_m: tuple[float, float] = (6.0, 6.0),
        cell_size_m: float = 0.05,
        fidelity: str = "standard",
        seed: int = 0,
        container: Container | None = None,
        floor_depth_m: float = 0.0,
    ) -> None:
        if not isinstance(preset, SoilParameters):
            require_choice("preset", preset, tuple(PRESETS))
            preset = PRESETS[preset]
        require_choice("fidelity", fidelity, tuple(FIDELITIES))
        require(len(extent_m) == 2, f"extent_m={extent_m!r}; allowed: two lengths, along x and y.")
        require(0.0 <= floor_depth_m < math.inf, f"floor_depth_m={floor_depth_m!r}; allowed: 0 and above, finite.")
        require(seed >= 0, f"seed={seed!r}; allowed: 0 and above.")
        require(
            container is None or not container.overlaps(extent_m),
            "container overlaps the dig area; move its center_w outside of extent_m.",
        )
        nx, ny = (_whole_cells(extent_m[axis], cell_size_m, f"extent_m[{axis}]") for axis in range(2))
        self.parameters: SoilParameters = preset
        self.fidelity = FIDELITIES[fidelity]
        self.container = container
        self.floor_depth_m = float(floor_depth_m)
        self._seed = seed
        self._field = HeightField((nx, ny), (cell_size_m, cell_size_m), self.floor_depth_m)
        self._box_field = _box_field(container, cell_size_m)
        self._bucket = Bucket(self.parameters, self.fidelity)
        self._loose = LooseSoil(
            self.parameters, self.fidelity, self._field, self._box_field, container, self.floor_depth_m
        )
        self._resistance = SoilResistance(self.parameters, self.fidelity.force_slices)
        self.reset()

    def reset(
        self,
        heights_m: ArrayLike | None = None,
        *,
        firm_heights_m: ArrayLike | None = None,
        container_heights_m: ArrayLike | None = None,
    ) -> None:
        """Put new soil in dig area and box, and remove it everywhere else: bucket, air, out of bounds.

        All heights count from the rigid floor and are kept byte for byte.

        Args:
            heights_m: Soil in the dig area, (nx, ny); None makes an empty floor.
            firm_heights_m: How high soil lies there that was never loosened, (nx, ny); None means all of it.
            container_heights_m: Soil in the target box, (mx, my), all of it loosened; None makes an empty box.

        Raises:
            ConfigurationError: A shape is wrong, a height is negative or not finite, or there is no box to fill.
        """
        boxed = container_heights_m is not None
        require(not boxed or self.container is not None, "container_heights_m is given, and there is no container.")
        self._field.reset(heights_m, firm_heights_m)
        self._box_field.reset(container_heights_m, np.zeros(self._box_field.heights.shape))
        self._loose.clear()
        self._bucket.clear()
        self._resistance.forget()
        self._out_of_bounds_m3 = 0.0
        self._out_of_bounds_kg = 0.0
        self._load_kg = 0.0
        self._rng = np.random.default_rng(self._seed)

    def add_parcels(self, positions_w: ArrayLike, velocities_w: ArrayLike) -> None:
        """Add loose soil at (n, 3) centres [m]; each parcel brings `parcel_mass_kg` into the ledger.

        One that begins inside another one, or is beyond the fidelity's bound on awake parcels, joins one near it. If
        those have taken up enough already, it lands at once on what is below it.

        Raises:
            ConfigurationError: The shapes are not the same (n, 3), or a value is not finite.
        """
        positions = np.array(positions_w, dtype=np.float64)
        velocities = np.array(velocities_w, dtype=np.float64)
        require(
            positions.ndim == 2 and positions.shape[1:] == (3,) and velocities.shape == positions.shape,
            f"positions_w {positions.shape} and velocities_w {velocities.shape}; allowed: both (n, 3).",
        )
        finite = bool(np.isfinite(positions).all() and np.isfinite(velocities).all())
        require(finite, "positions_w or velocities_w holds values that are not finite.")
        positions[:, 2] += self.floor_depth_m
        masses = np.full(len(positions), self.parcel_mass_kg)
        self._out_of_bounds_kg += self._loose.add(positions, velocities, masses, apart=True)
        self._load_kg, _ = self._weighed_load(None)  # one may have joined the load

    def lay_down(self) -> None:
        """Turn all loose soil into ground at once, the load of the bucket included, each part on what is below it.

        It may lie too steep: later steps let it avalanche.
        """
        self._give_birth(is_last=True)
        self._out_of_bounds_kg += self._loose.lay_down()
        self._load_kg, _ = self._weighed_load(None)

    def step(self, dt_s: float = TICK_S, tool: Tool | None = None) -> Reaction:
        """Advance by one step.

        Args:
            dt_s: Duration, above 0 and at most 0.1 s.
            tool: Where the bucket is at the end of the step and how it moves; None if there is none. It cuts
                along the path from where it was in the last step; if it was not there, it cuts nothing.

        Returns:
            Resistance to the tool and its payload.

        Raises:
            ConfigurationError: The duration is out of range, or the tool jumped.
        """
        if not 0.0 < dt_s <= 0.1:
            raise ConfigurationError(f"dt_s={dt_s!r}; allowed: above 0 and at most 0.1 s.")
        before, entered = self._bucket.pose, 0.0
        if tool is None:
            self._bucket.leave(self._field)
            self._resistance.forget()
        else:
            load_m3 = self._load_kg / self.density_kg_m3
            entered, lost = self._bucket.move(tool, self._field, self.floor_depth_m, load_m3)
            self._out_of_bounds_m3 += lost
            self._give_birth(is_last=entered == 0.0 and load_m3 == 0.0)
        geometry = None if tool is None else tool.geometry
        self._out_of_bounds_kg += self._loose.step(geometry, before, self._bucket.pose, dt_s, cutting=entered > 0.0)
        self._load_kg, com_t = self._weighed_load(tool)
        for field in (self._field, self._box_field):
            self._out_of_bounds_m3 += field.flow(dt_s, self.parameters.strength)
        return self._reaction(tool, dt_s, com_t)

    def _reaction(self, tool: Tool | None, dt_s: float, com_t: Array) -> Reaction:
        """Return what the soil does to the tool at the end of a step."""
        if tool is None:
            return Reaction.free(self.payload_mass_kg, com_t)
        ground = self._field.heights, self._loose.weighed_heights(), self._field.grid
        reaction = self._resistance.react(*ground, tool, self.floor_depth_m, dt_s, self.payload_mass_kg, com_t)
        return reaction.with_impulse(self._loose.population.impact.impulse)

    def _give_birth(self, *, is_last: bool) -> None:
        """Turn the soil that has entered the bucket into parcels at rest, where it was."""
        points_t, masses = self._bucket.births(all_of_it=is_last, rng=self._rng)
        pose = self._bucket.pose
        if len(masses) and pose is not None:
            born = pose.place(points_t), np.zeros_like(points_t), masses
            self._out_of_bounds_kg += self._loose.add(*born, apart=False)

    def _weighed_load(self, tool: Tool | None) -> tuple[float, Array]:
        """Return mass [kg] and centre of mass (3,) [m] of the load; the centroid of an empty bucket."""
        state, pose = self._loose.population.state, self._bucket.pose
        rows = np.flatnonzero(state.load)
        masses = state.masses[rows]
        mass = float(masses.sum())
        if tool is None or pose is None:
            return mass, np.zeros(3)
        if mass == 0.0:
            return mass, tool.geometry.centroid_t
        centre = masses @ state.positions[rows] / mass
        return mass, np.asarray((centre - pose.position) @ pose.rotation)

    @property
    def heights_m(self) -> Array:
        """(nx, ny) heights above the rigid floor [m], x first: a read-only view that later steps change."""
        return _read_only(self._field.heights)

    @property
    def firm_heights_m(self) -> Array:
        """(nx, ny) how high soil lies that was never loosened [m]: a read-only view that later steps change."""
        return _read_only(self._field.layer.firm)

    @property
    def container_heights_m(self) -> Array | None:
        """(mx, my) heights above the floor of the target box [m] along its own x and y, or None without a box."""
        return None if self.container is None else _read_only(self._box_field.heights)

    @property
    def x_w(self) -> Array:
        """(nx,) x of the cell centres [m]."""
        return self._field.centres(0)

    @property
    def y_w(self) -> Array:
        """(ny,) y of the cell centres [m]."""
        return self._field.centres(1)

    @property
    def density_kg_m3(self) -> float:
        """Bulk density in the ground; loosened soil has this over its swell."""
        return self.parameters.density_kg_m3

    @property
    def parcel_positions_w(self) -> Array:
        """(n, 3) centres of all parcels, those in the bucket included [m]: a copy."""
        return np.asarray(self._loose.population.state.positions - np.array([0.0, 0.0, self.floor_depth_m]))

    @property
    def parcel_velocities_w(self) -> Array:
        """(n, 3) velocities of all parcels [m/s]: a copy."""
        return self._loose.population.state.velocities.copy()

    @property
    def parcel_radii_m(self) -> Array:
        """(n,) radius of each parcel: a copy. Parcels that others have joined are larger than `parcel_radius_m`."""
        return self._loose.population.state.radii.copy()

    @property
    def parcel_masses_kg(self) -> Array:
        """(n,) mass of each parcel: a copy."""
        return self._loose.population.state.masses.copy()

    @property
    def parcel_is_load(self) -> Bools:
        """(n,) whether each parcel belongs to the load of the bucket."""
        return np.asarray(self._loose.population.state.load == 1)

    @property
    def parcel_is_asleep(self) -> Bools:
        """(n,) whether each parcel rests in the bucket and moves with it as one body."""
        return np.asarray(self._loose.population.state.asleep == 1)

    @property
    def awake_parcel_count(self) -> int:
        """Number of parcels that move by themselves."""
        return self._loose.population.awake_count

    @property
    def parcel_radius_m(self) -> float:
        """Radius of a whole parcel."""
        return self.fidelity.parcel_radius_m

    @property
    def parcel_mass_kg(self) -> float:
        """Mass of a whole parcel."""
        return self._loose.whole_kg

    @property
    def payload_mass_kg(self) -> float:
        """Mass of the soil in the bucket."""
        return self._load_kg + self._bucket.waiting_m3 * self.density_kg_m3

    @property
    def airborne_mass_kg(self) -> float:
        """Mass of the parcels that are not in the bucket: falling, or not yet at rest on the ground."""
        state = self._loose.population.state
        return float(state.masses[state.load == 0].sum())

    @property
    def box_mass_kg(self) -> float:
        """Mass of the soil at rest in the target box."""
        return self._box_field.solid_m3(self.parameters.swell) * self.density_kg_m3

    def mechanical_energy_j(self) -> float:
        """Return the kinetic energy of all parcels and their potential energy above the rigid floor."""
        state = self._loose.population.state
        spinning = 0.4 * state.masses * state.radii**2 * (state.spins**2).sum(axis=1)
        moving = state.masses * (state.velocities**2).sum(axis=1)
        potential = GRAVITY_M_S2 * float(state.masses @ state.positions[:, 2])
        return 0.5 * float((moving + spinning).sum()) + potential

    def ledger_kg(self) -> dict[str, float]:
        """Return the mass in each place; the sum is constant but for `reset` and `add_parcels`."""
        return {
            "grid": self._field.solid_m3(self.parameters.swell) * self.density_kg_m3,
            "parcels": self.airborne_mass_kg,
            "bucket": self.payload_mass_kg,
            "box": self.box_mass_kg,
            "out_of_bounds": self._out_of_bounds_m3 * self.density_kg_m3 + self._out_of_bounds_kg,
        }

    def height_at(self, xy_w: ArrayLike) -> Array:
        """Return the world z of the ground [m], bilinear between cell centres; z = 0 outside of the extent.

        Raises:
            ConfigurationError: The last axis of the points (..., 2) is not 2.
        """
        points = np.asarray(xy_w, dtype=np.float64)
        require(points.shape[-1:] == (2,), f"xy_w has shape {points.shape}; allowed: (..., 2).")
        flat = points.reshape(-1, 2)
        heights = np.where(self._field.contains(flat), self._field.sample(flat) - self.floor_depth_m, 0.0)
        return np.asarray(heights.reshape(points.shape[:-1]))


def _read_only(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view


def _box_field(container: Container | None, cell_size_m: float) -> HeightField:
    """Return the field on the container's floor, with cells as near to square as fit; one empty cell without it."""
    if container is None:
        return HeightField((1, 1), (cell_size_m, cell_size_m), 0.0)
    lengths = 2.0 * container.half_extent_m
    shape = (max(1, round(lengths[0] / cell_size_m)), max(1, round(lengths[1] / cell_size_m)))
    return HeightField(shape, (lengths[0] / shape[0], lengths[1] / shape[1]), container.wall_height_m)
