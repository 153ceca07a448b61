"""The load of the bucket: which parcels belong to it, and when they rest in it as one body."""

import math

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.cutting import to_tool
from lerobot_excav.envs.soil.parcels.contact import cross
from lerobot_excav.envs.soil.parcels.dynamics import WAKING_SPEED_M_S
from lerobot_excav.envs.soil.parcels.plates import ToolPath, inside_depth
from lerobot_excav.envs.soil.parcels.store import TOUCHES_NOTHING, State

LARGEST_HEAP_M = 0.35
"""Parcels up to this far above an opening that looks up belong to the load (guess: half the opening, 45 degrees)."""

LOOKS_UP = 0.3
"""Least vertical part of the opening's normal that counts as up: 17 degrees above level (guess)."""

LEAVING_M_S = 1.0
"""Speed in the bucket above which a parcel over the opening has left the heap (guess)."""

RESTING_SPEED_M_S = 0.08
"""Root mean square speed in the bucket below which a load is at rest (tuned: a load that shakes with the machine)."""

FLOWING_SPEED_M_S = 0.3
"""Speed in the bucket above which a parcel flows (guess)."""

MOST_FLOWING = 0.01
"""Share of a load's mass that may flow while it is at rest: a thin layer that pours over the edge is more (tuned)."""

RESTING_TIME_S = 0.1
"""How long it stays so before it falls asleep."""

WAKING_TILT_RAD = math.radians(6.0)
"""Change of the direction of weight, in the bucket, that wakes a load (guess: sand starts to slide a few degrees above
the slope at which it stops)."""

_ACCELERATION_TIME_S = 0.1
"""Time constant of the measured acceleration: the machine's vibration does not wake a load (guess)."""


@kernel
def find_load(state: State, tool: ToolPath) -> tuple[float, float, float, int]:
    """Mark the parcels, in `state.load`, that lie in the bucket's last pose or in the heap above its opening and rim.

    Returns mass [kg] and mean square speed [m2/s2], relative to the bucket, of the load that is awake; the share of it
    that flows; 1 if it touches the ground, else 0.
    """
    step = len(tool.positions) - 1
    position, rotation = tool.positions[step], tool.rotations[step]
    w = (tool.angular[0], tool.angular[1], tool.angular[2])
    up = tool.planes[0, 0] * rotation[2, 0] + tool.planes[0, 2] * rotation[2, 2]
    first, last = tool.profile[0], tool.profile[len(tool.profile) - 1]
    length = math.sqrt((last[0] - first[0]) ** 2 + (last[1] - first[1]) ** 2)
    mass, energy, flowing, touching = 0.0, 0.0, 0.0, 0
    positions, velocities, masses, radii = state.positions, state.velocities, state.masses, state.radii
    asleep, load, ground, linear, planes = state.asleep, state.load, state.ground, tool.linear, tool.planes
    for i in range(len(masses)):
        if asleep[i]:
            continue
        p = (positions[i, 0], positions[i, 1], positions[i, 2])
        q = to_tool(position, rotation, p[0], p[1], p[2])
        turning = cross(w, (p[0] - position[0], p[1] - position[1], p[2] - position[2]))
        speed = 0.0
        for a in range(3):
            speed += (velocities[i, a] - linear[a] - turning[a]) ** 2
        above = -inside_depth(planes[:1], 0, q)
        load[i] = 0
        if above <= 0.0:
            load[i] = 1 if inside_depth(planes, 1, q) > 0.0 else 0
        elif above < LARGEST_HEAP_M and up > LOOKS_UP and abs(q[1]) < tool.half_width + radii[i]:
            along = (q[0] - first[0]) * (last[0] - first[0]) + (q[2] - first[1]) * (last[1] - first[1])
            over = abs(along / length - 0.5 * length) < 0.5 * length + radii[i]
            load[i] = 1 if over and speed < LEAVING_M_S**2 else 0
        if load[i]:
            mass += masses[i]
            energy += masses[i] * speed
            if speed > FLOWING_SPEED_M_S**2:
                flowing += masses[i]
            if ground[i] != TOUCHES_NOTHING:
                touching = 1
    if mass == 0.0:
        return 0.0, 0.0, 0.0, touching
    return mass, energy / mass, flowing / mass, touching


def places_in(position: Array, rotation: Array, positions: Array) -> Array:
    """Turn (n, 3) world points into the tool frame [m]."""
    result: Array = (positions - position) @ rotation
    return result


class Rest:
    """Puts the load of one bucket to sleep and wakes it.

    A sleeping load is part of the bucket. It wakes when the direction of its weight, acceleration included, has
    turned in the bucket, when the bucket cuts, and when another parcel hits it.
    """

    def __init__(self) -> None:
        """Start with nothing known."""
        self.clear()

    def clear(self) -> None:
        """Forget the bucket."""
        self._calm_s = 0.0
        self._velocity: Array | None = None
        self._acceleration: Array = np.zeros(3)
        self._weight_t: Array = np.zeros(3)

    def update(self, state: State, tool: ToolPath, dt_s: float, hit_m_s: float, *, cutting: bool) -> None:
        """Look at the load after a step, with the fastest hit on a sleeping parcel; cutting: soil entered the bucket.

        Changes `load`, `asleep` and `places_t` of the state.
        """
        weight_t = self._direction_of_weight(tool, dt_s)
        woken = False
        if state.asleep.any():
            turned = math.acos(max(-1.0, min(1.0, float(weight_t @ self._weight_t))))
            woken = cutting or hit_m_s > WAKING_SPEED_M_S or turned > WAKING_TILT_RAD
        if woken:
            state.asleep[:] = 0
            self._calm_s = 0.0
        mass, square_speed, flowing, touching = find_load(state, tool)
        slow = square_speed < RESTING_SPEED_M_S**2 and flowing <= MOST_FLOWING
        calm = mass > 0.0 and slow and not touching and not cutting
        self._calm_s = self._calm_s + dt_s if calm else 0.0
        if self._calm_s >= RESTING_TIME_S and not woken:  # one step at least to move in, however long that is
            if not state.asleep.any():
                self._weight_t = weight_t
            put_to_sleep(state, tool)
            self._calm_s = 0.0

    def _direction_of_weight(self, tool: ToolPath, dt_s: float) -> Array:
        """Return the unit vector along gravity minus acceleration, in the tool frame."""
        if self._velocity is not None:
            share = -math.expm1(-dt_s / _ACCELERATION_TIME_S)
            self._acceleration += share * ((tool.linear - self._velocity) / dt_s - self._acceleration)
        self._velocity = tool.linear.copy()
        weight = (np.array([0.0, 0.0, -GRAVITY_M_S2]) - self._acceleration) @ tool.rotations[-1]
        length = math.sqrt(weight.dot(weight))
        return np.asarray(weight / length) if length > 0.0 else np.array([0.0, 0.0, -1.0])


def put_to_sleep(state: State, tool: ToolPath) -> None:
    """Fix the load to the bucket where it lies."""
    rows = np.flatnonzero((state.load == 1) & (state.asleep == 0))
    state.places_t[rows] = places_in(tool.positions[-1], tool.rotations[-1], state.positions[rows])
    state.asleep[rows] = 1
    state.ground_springs[rows] = 0.0
    state.plate_springs[rows] = 0.0
