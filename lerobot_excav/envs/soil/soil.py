"""The soil: one class that owns every kilogram and steps it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lerobot_excav.envs.soil.bucket import Bucket
from lerobot_excav.envs.soil.container import Container
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.forces import DiggingResistance
from lerobot_excav.envs.soil.height_field import HeightField
from lerobot_excav.envs.soil.parameters import PRESETS, SoilParameters
from lerobot_excav.envs.soil.parcels import IN_BOX, NO_BOX, ON_GRID, Box, Parcels
from lerobot_excav.envs.soil.tool import Reaction, Tool
from lerobot_excav.errors import require, require_choice

Array = NDArray[np.float64]


def _whole_cells(length_m: float, cell_size_m: float, field: str) -> int:
    """Return how many cells make a length; it must be a whole number."""
    require(
        length_m > 0 and cell_size_m > 0,
        f"{field}={length_m!r}, cell_size_m={cell_size_m!r}; allowed: above 0.",
    )
    count = round(length_m / cell_size_m)
    require(
        count >= 2 and abs(count * cell_size_m - length_m) < 1e-6,
        f"{field}={length_m!r} is not a whole number (2 or more) of cells of cell_size_m={cell_size_m!r}; "
        "change one of the two.",
    )
    return count


class Soil:
    """Deformable soil on a rigid floor, a bucket's load, soil in the air and soil in a target box.

    World frame: origin at the centre of the extent, z up. Heights count from the rigid floor, which lies
    `floor_depth_m` below z = 0. Around the extent the ground is level at z = 0; soil that gets there is out of
    bounds. Every kilogram is in one entry of `ledger_kg`, whose sum no step changes.

    Args:
        preset: Name of the soil, one of `PRESETS`.
        extent_m: Size of the dig area along x and y; a whole number of cells.
        cell_size_m: Size of a column.
        fidelity: Numerical effort, one of `FIDELITIES`.
        seed: Seed of the jitter of spilled parcels; `reset` starts it anew.
        container: Target box outside of the dig area, or None.
        floor_depth_m: Depth of the rigid floor below z = 0.

    Raises:
        ConfigurationError: An argument has a value that cannot be used.
    """

    def __init__(
        self,
        preset: str = "sand",
        extent_m: tuple[float, float] = (6.0, 6.0),
        cell_size_m: float = 0.05,
        fidelity: str = "standard",
        seed: int = 0,
        container: Container | None = None,
        floor_depth_m: float = 0.0,
    ) -> None:
        require_choice("preset", preset, PRESETS)
        require_choice("fidelity", fidelity, FIDELITIES)
        require(floor_depth_m >= 0.0, f"floor_depth_m={floor_depth_m!r}; allowed: 0 and above.")
        require(
            container is None or not container.overlaps(extent_m),
            "container overlaps the dig area; move its center_w outside of extent_m.",
        )
        shape = (
            _whole_cells(extent_m[0], cell_size_m, "extent_m[0]"),
            _whole_cells(extent_m[1], cell_size_m, "extent_m[1]"),
        )
        self.parameters: SoilParameters = PRESETS[preset]
        self.fidelity = FIDELITIES[fidelity]
        self.container = container
        self.floor_depth_m = float(floor_depth_m)
        self._seed = seed
        self._field = HeightField(shape, (cell_size_m, cell_size_m), self.floor_depth_m)
        self._box_field = _box_field(container, cell_size_m)
        self._box = _box_numbers(container)
        self._parcels = Parcels()
        self._bucket = Bucket(self.parameters, self.fidelity)
        self._resistance = DiggingResistance(self.parameters, self.fidelity.force_slices)
        self.reset()

    def reset(self, heights_m: ArrayLike | None = None) -> None:
        """Put new soil in the dig area and remove it everywhere else: box, bucket, air, out of bounds.

        Args:
            heights_m: (nx, ny) heights above the rigid floor, kept byte for byte; None for an empty floor.

        Raises:
            ConfigurationError: The shape is wrong, or a height is negative or not finite.
        """
        self._field.reset(heights_m)
        self._box_field.reset(None)
        self._parcels.clear()
        self._bucket.clear()
        self._out_of_bounds_m3 = 0.0
        self._out_of_bounds_kg = 0.0
        self._rng = np.random.default_rng(self._seed)

    def add_parcels(self, positions_w: ArrayLike, velocities_w: ArrayLike) -> None:
        """Add soil in the air; each parcel brings `parcel_mass_kg` into the ledger.

        Args:
            positions_w: (n, 3) centres [m].
            velocities_w: (n, 3) [m/s].

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
        self._parcels.add(positions, velocities, np.full(len(positions), self.parcel_mass_kg))

    def step(self, dt_s: float = 0.02, tool: Tool | None = None) -> Reaction:
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
        require(0.0 < dt_s <= 0.1, f"dt_s={dt_s!r}; allowed: above 0 and at most 0.1 s.")
        force: Array = np.zeros(3)
        torque: Array = np.zeros(3)
        if tool is None:
            self._bucket.leave(self._field)
        else:
            force, torque = self._resistance.wrench(
                self._field.heights, self._field.grid, tool, self.floor_depth_m
            )
            self._out_of_bounds_m3 += self._bucket.move(tool, self._field, self.floor_depth_m)
            self._out_of_bounds_m3 += self._bucket.spill(tool, self._field, self._parcels, dt_s, self._rng)
        self._fly(dt_s)
        for field in (self._field, self._box_field):
            self._out_of_bounds_m3 += field.relax(self.fidelity.sweeps_per_tick, self.parameters.slope_tan)
        load = self._bucket.load
        com = np.zeros(3) if load is None else load.com_t
        return Reaction(
            force_w_n=force, torque_w_nm=torque, payload_mass_kg=self.payload_mass_kg, payload_com_t=com
        )

    def _fly(self, dt_s: float) -> None:
        """Move the soil in the air and merge what landed."""
        ground = (self._field.heights, self._field.grid, -self.floor_depth_m)
        inside = (self._box_field.heights, self._box_field.grid)
        landed = self._parcels.step(dt_s, self.parcel_radius_m, ground, inside, self._box)
        for place, parcels in landed.items():
            volumes: Array = parcels.masses_kg / self.density_kg_m3
            if place == ON_GRID:
                self._field.deposit(parcels.points_w, volumes)
            elif place == IN_BOX and self.container is not None:
                self._box_field.deposit(self.container.to_local(parcels.points_w), volumes)
            else:
                self._out_of_bounds_kg += float(parcels.masses_kg.sum())

    @property
    def heights_m(self) -> Array:
        """(nx, ny) heights above the rigid floor [m], x first: a read-only view that later steps change."""
        return _read_only(self._field.heights)

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
        """Bulk density, the same everywhere."""
        return self.parameters.density_kg_m3

    @property
    def parcel_positions_w(self) -> Array:
        """(n, 3) centres of the parcels in the air [m]: a copy."""
        return self._parcels.positions_w.copy()

    @property
    def parcel_radius_m(self) -> float:
        """Radius of a parcel."""
        return self.parameters.parcel_radius_m

    @property
    def parcel_mass_kg(self) -> float:
        """Mass of a whole parcel."""
        return self.parameters.parcel_mass_kg

    @property
    def payload_mass_kg(self) -> float:
        """Mass of the soil in the bucket."""
        return self._bucket.payload_m3 * self.density_kg_m3

    @property
    def payload_surface_t(self) -> Array:
        """(n, 2) polyline (x_t, z_t) of the load's free surface [m], half-way between the side plates; n may be 0."""
        load = self._bucket.load
        return np.zeros((0, 2)) if load is None else load.surface_t.copy()

    def ledger_kg(self) -> dict[str, float]:
        """Return the mass in each place; the sum is constant but for `reset` and `add_parcels`."""
        return {
            "grid": self._field.volume_m3 * self.density_kg_m3,
            "parcels": self._parcels.mass_kg,
            "bucket": self.payload_mass_kg,
            "box": self._box_field.volume_m3 * self.density_kg_m3,
            "out_of_bounds": self._out_of_bounds_m3 * self.density_kg_m3 + self._out_of_bounds_kg,
        }

    def height_at(self, xy_w: ArrayLike) -> Array:
        """Return the world z of the ground [m], bilinear between cell centres; z = 0 outside of the extent.

        Args:
            xy_w: (..., 2) points [m].

        Raises:
            ConfigurationError: The last axis is not 2.
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


def _box_numbers(container: Container | None) -> Box:
    if container is None:
        return NO_BOX
    x, y, z = (float(v) for v in container.center_w)
    cos, sin = (float(v) for v in container.axes_w[0])
    half_x, half_y = (float(v) for v in container.half_extent_m)
    return (x, y, z, half_x, half_y, z + container.wall_height_m, cos, sin)
