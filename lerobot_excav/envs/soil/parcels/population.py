"""All parcels of a soil: they join, move, carry, land and leave."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lerobot_excav.envs.soil.arrays import Array, Bools, Flags, Indices, vector_product
from lerobot_excav.envs.soil.parcels.dynamics import Laws, advance, carry
from lerobot_excav.envs.soil.parcels.ground import Site
from lerobot_excav.envs.soil.parcels.impact import Impact
from lerobot_excav.envs.soil.parcels.joining import CROWDED, MOST_JOINED, STAYS, WITHOUT_ROOM, join
from lerobot_excav.envs.soil.parcels.load import Rest, put_to_sleep
from lerobot_excav.envs.soil.parcels.pairs import enlarged, room_for
from lerobot_excav.envs.soil.parcels.plates import ToolPath, bucket_reach
from lerobot_excav.envs.soil.parcels.settling import find_settled
from lerobot_excav.envs.soil.parcels.store import (
    TOUCHES_BOX_FLOOR,
    TOUCHES_GROUND,
    State,
    copy_rows,
    empty_state,
    keep,
    rows,
)

SETTLING_PACE = 0.25
"""Near a bucket that moves, a parcel rests only if it is slower than this share of the edge's speed: what goes with the
bucket does not lie still, however slow that is (tuned: as much sand in the bucket at 0.05 m/s as at 1 m/s)."""

STIRRING_M_S = 0.01
"""Speed added to that, at which parcels at rest still stir (guess)."""

STANDING_M_S = 0.02
"""Speed of the edge below which the bucket stands still (guess)."""

NEAR_BUCKET_M = 0.45
"""How far beyond the bucket's corners soil may move along with it: the heap before its opening (guess)."""

_FIRST_CAPACITY = 1024

_NOWHERE: Array = np.zeros(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Landed:
    """Parcels that have become ground."""

    points_w: Array  # (n, 2) where they lay [m]
    masses_kg: Array  # (n,) their masses
    place: Flags  # (n,) what they lay on, one of `store.TOUCHES_…`

    @property
    def is_on_ground(self) -> Bools:
        """Tell which lay in the dig area."""
        return np.asarray(self.place == TOUCHES_GROUND)

    @property
    def is_in_box(self) -> Bools:
        """Tell which lay in the target box."""
        return np.asarray(self.place == TOUCHES_BOX_FLOOR)


_NONE_LANDED = Landed(points_w=np.zeros((0, 2)), masses_kg=np.zeros(0), place=np.zeros(0, dtype=np.uint8))


class Population:
    """All parcels, each in one row of `state`, where z counts from the rigid floor.

    They may touch so many plates, those of the bucket and of the box together. Radius and mass are those of a whole
    parcel. Above the bound on the awake ones, a new parcel joins one near it instead.

    Attributes:
        state: The parcels.
        impact: What they gave to the bucket in the last step, beyond a load that is welded to it.
    """

    def __init__(self, plates: int, laws: Laws, radius_m: float, mass_kg: float, most_awake: int) -> None:
        self._plates = plates
        self._laws = laws
        self._radius_m = radius_m
        self._mass_kg = mass_kg
        self._most_awake = most_awake
        self._rest = Rest()
        self.impact = Impact()
        # Room to spare keeps large arrays from being allocated in every step.
        self._all = empty_state(_FIRST_CAPACITY, plates)
        self._pairs, self._spare = room_for(_FIRST_CAPACITY), room_for(_FIRST_CAPACITY)
        self.clear()

    def clear(self) -> None:
        """Remove all parcels."""
        self.state = rows(self._all, 0)
        self._rows: Indices = np.zeros(0, dtype=np.int64)
        self._tool: ToolPath | None = None
        self._rest.clear()
        self.impact.clear()

    def __setstate__(self, attributes: dict[str, Any]) -> None:
        """Restore a copy: `state` must look into its arrays again, since a copy of a view owns its data."""
        self.__dict__.update(attributes)
        copy_rows(self.state, self._all)
        self.state = rows(self._all, len(self.state.masses))

    def allow_plates(self, plates: int) -> None:
        """Set how many plates parcels may touch; a new number clears the memory of those contacts."""
        if plates != self._plates:
            self._plates = plates
            count = len(self.state.masses)
            springs = empty_state(len(self._all.masses), plates).plate_springs
            self._all = self._all._replace(plate_springs=springs)
            self.state = rows(self._all, count)

    @property
    def awake_count(self) -> int:
        """Number of parcels that are computed."""
        return int(len(self.state.asleep) - self.state.asleep.sum())

    def add(self, positions: Array, velocities: Array, masses_kg: Array, *, apart: bool) -> Bools:
        """Add parcels at (n, 3) centres [m], z above the rigid floor, with (n, 3) velocities [m/s] and (n,) masses.

        Their radius follows from their mass. Above the bound on awake parcels, mass and momentum join the nearest one
        that is not too large already. Apart: so does a parcel that would begin inside another one.

        Returns (n,) which found no room; the caller has to put them elsewhere.
        """
        free = max(0, self._most_awake - self.awake_count)
        if apart or len(positions) > free:
            without_room = self._join(positions, velocities, masses_kg, free, apart=apart)
        else:
            self._append(positions, velocities, masses_kg)
            without_room = np.zeros(len(positions), dtype=np.bool_)
        self.state.radii[:] = self._radius_m * np.cbrt(self.state.masses / self._mass_kg)
        return without_room

    def _append(self, positions: Array, velocities: Array, masses_kg: Array) -> None:
        """Add rows."""
        old, added = self.state, len(positions)
        count = len(old.masses) + added
        if count > len(self._all.masses):
            self._all = empty_state(2 * count, self._plates)
            copy_rows(old, self._all)
            self._pairs = enlarged(self._pairs, 2 * count)
            self._spare = room_for(2 * count)
        new = empty_state(added, self._plates)
        new.positions[:], new.velocities[:], new.masses[:] = positions, velocities, masses_kg
        copy_rows(new, State._make(array[len(old.masses) :] for array in self._all))
        self.state = rows(self._all, count)
        self._rows = np.concatenate([self._rows, np.full(added, -1, dtype=np.int64)])

    def _join(self, positions: Array, velocities: Array, masses_kg: Array, free: int, *, apart: bool) -> Bools:
        """Add rows for those that can stay, and let others join; return which found no room."""
        state, old = self.state, len(self.state.masses)
        points = np.concatenate([state.positions, positions])
        moving = np.concatenate([state.velocities, velocities])
        masses = np.concatenate([state.masses, masses_kg])
        most_kg = max(MOST_JOINED * self._mass_kg, float(masses_kg.max(initial=0.0)))
        radii = self._radius_m * np.cbrt(masses / self._mass_kg)
        fate = join(points, moving, masses, radii, state.asleep, free, most_kg, CROWDED if apart else 0.0)
        state.positions[:], state.velocities[:], state.masses[:] = points[:old], moving[:old], masses[:old]
        stay = old + np.flatnonzero(fate[old:] == STAYS)
        self._append(points[stay], moving[stay], masses[stay])
        return np.asarray(fate[old:] == WITHOUT_ROOM)

    def step(self, tool: ToolPath, site: Site, dt_s: float, *, cutting: bool) -> None:
        """Move all parcels and find the load of the bucket; cutting: soil entered it."""
        self._tool = tool
        if len(self.state.masses) == 0 or not tool.present:
            self.impact.clear()
        if len(self.state.masses) == 0:
            return
        steps, hit, pushes = len(tool.positions) - 1, 0.0, np.zeros(6)
        if self.awake_count > 0:
            self._pairs, self._spare, hit = advance(
                self.state, self._pairs, self._spare, self._rows, tool, site, self._laws, dt_s / steps, steps, pushes
            )
            self._rows = np.arange(len(self.state.masses))
        elif tool.present:
            carry(self.state, tool, steps)
        if tool.present:
            motion = tool.positions[-1], tool.linear, tool.angular
            self.impact.moved(self.state, *motion, pushes)
            self._rest.update(self.state, tool, dt_s, hit, cutting=cutting)
            self.impact.found(self.state, *motion)

    def freeze_load(self, tool: ToolPath) -> None:
        """Let the load sleep in a bucket that goes away, wherever that will come back; until then it stands still."""
        put_to_sleep(self.state, tool)
        sleeping = self.state.asleep == 1
        self.state.velocities[sleeping] = 0.0
        self.state.spins[sleeping] = 0.0
        self._rest.clear()

    def _stirred(self) -> tuple[Array, float, float]:
        """Return around what place [m] and how far [m] the bucket stirs the soil, and at what speed [m/s]."""
        tool = self._tool
        if tool is None or not tool.present:
            return _NOWHERE, 0.0, 0.0
        edge = tool.rotations[-1] @ np.array([tool.profile[0, 0], 0.0, tool.profile[0, 1]])
        velocity = tool.linear + vector_product(tool.angular, edge)
        pace = math.sqrt(velocity.dot(velocity))
        if pace <= STANDING_M_S:
            return _NOWHERE, 0.0, 0.0
        return tool.positions[-1], bucket_reach(tool) + NEAR_BUCKET_M, SETTLING_PACE * pace + STIRRING_M_S

    def settle(self, site: Site, dt_s: float) -> Landed:
        """Take out the parcels that have come to rest.

        Outside of dig area and box they go as soon as they touch, and so does what is caught between the
        outside of the bucket and the ground: a parcel there would push the bucket up. One that has rested elsewhere
        for long, say on the rim of the box, drops to what is below it. `dt_s` is the duration of the step before.
        """
        state = self.state
        if len(state.masses) == 0:
            return _NONE_LANDED
        gone = find_settled(state, site, *self._stirred(), dt_s)
        landed = Landed(points_w=state.positions[gone, :2], masses_kg=state.masses[gone], place=state.ground[gone])
        if len(landed.masses_kg):
            self.state = rows(self._all, keep(state, ~gone))
            self._rows = self._rows[~gone]
        return landed
