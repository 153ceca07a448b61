"""Small worlds, in which tests let kernels and their twins meet."""

import math
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.height_field import Grid, HeightField
from lerobot_excav.envs.soil.motion import Pose, path
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.dynamics import Laws, advance
from lerobot_excav.envs.soil.parcels.ground import Site
from lerobot_excav.envs.soil.parcels.pairs import room_for
from lerobot_excav.envs.soil.parcels.plates import NO_BOX, BoxWalls, ToolPath
from lerobot_excav.envs.soil.parcels.population import Population
from lerobot_excav.envs.soil.parcels.store import WALLS, State, empty_state

RADIUS = 0.045
MASS = 0.94
DT = 0.001
STIFFNESS = MASS * (0.2 / DT) ** 2
PLATES = len(BUCKET.profile_t) + 1 + WALLS
LAWS = Laws(Law(STIFFNESS, 0.5, 0.3), Law(STIFFNESS, 0.97, 0.6), Law(STIFFNESS, 0.49, 0.3))


def flat(height: float = 1.0, cells: int = 120) -> HeightField:
    """Return a level field of 5-cm cells."""
    field = HeightField((cells, cells), (0.05, 0.05), 0.0)
    field.reset(np.full((cells, cells), height))
    return field


def make_state(positions: ArrayLike, **arrays: ArrayLike) -> State:
    """Return parcels from positions (n, 3) [m] and any other array of a state by name."""
    points = np.asarray(positions)
    state = empty_state(len(points), PLATES)
    for name, value in {"positions": points, "radii": RADIUS, "masses": MASS, **arrays}.items():
        getattr(state, name)[:] = value
    return state


def random_state(rng: Generator, count: int, half_size: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> State:
    """Return parcels of different sizes that move and spin in a box of some size [m]."""
    radii = RADIUS * rng.uniform(0.7, 1.4, count)
    return make_state(
        np.asarray(centre) + rng.uniform(-1.0, 1.0, (count, 3)) * half_size,
        velocities=rng.normal(0.0, 1.0, (count, 3)),
        spins=rng.normal(0.0, 10.0, (count, 3)),
        radii=radii,
        masses=MASS * (radii / RADIUS) ** 3,
    )


def tool_path(
    position: ArrayLike = (0.0, 0.0, 0.0),
    pitch: float = math.pi,
    travel: ArrayLike = (0.0, 0.0, 0.0),
    turn: float = 0.0,
    steps: int = 1,
) -> ToolPath:
    """Return a bucket's path from one position [m] and pitch [rad] to another in some sub-steps."""
    start = np.asarray(position, dtype=np.float64)
    before, now = Pose(start, rotation_at(pitch)), Pose(start + np.asarray(travel), rotation_at(pitch + turn))
    positions, rotations, turned = path(before, now, steps)
    velocities = (now.position - start) / (steps * DT), turned / (steps * DT)
    half_width = 0.5 * float(BUCKET.inner_width_m)
    return ToolPath(1, BUCKET.profile_t, BUCKET.planes_t, half_width, positions, rotations, *velocities)


def no_tool(steps: int) -> ToolPath:
    """Return the absence of a bucket for some sub-steps."""
    return tool_path(steps=steps)._replace(present=0)


def site(
    height: float = 0.0, heights: Array | None = None, box: BoxWalls = NO_BOX, box_heights: Array | None = None
) -> Site:
    """Return ground of some height [m], 6 m x 6 m, level unless heights are given, with or without a box."""
    cells = np.full((60, 60), height) if heights is None else heights
    inside = np.zeros((8, 6)) if box_heights is None else box_heights
    grid = Grid.centred(cells.shape, 6.0 / len(cells), 6.0 / len(cells))
    box_grid = Grid.centred(inside.shape, 2.0 * box.half_x / inside.shape[0], 2.0 * box.half_y / inside.shape[1])
    return Site(cells, grid, inside, box_grid, box, height)


def make_population(most_awake: int = 1000, laws: Laws = LAWS) -> Population:
    """Return no parcels yet."""
    return Population(PLATES, laws, RADIUS, MASS, most_awake)


def run(state: State, steps: int, ground: Site | None = None, tool: ToolPath | None = None, laws: Laws = LAWS) -> float:
    """Advance a state by some sub-steps in one call; return the fastest hit on a sleeping parcel [m/s]."""
    count = len(state.masses)
    new = np.full(count, -1, dtype=np.int64)
    world = (tool or no_tool(steps), ground or site(), laws)
    return advance(state, room_for(count), room_for(count), new, *world, DT, steps, np.zeros(6))[2]


def assert_same(state: State, twin: State, *names: str) -> None:
    """Compare fields of two states."""
    for name in names:
        np.testing.assert_allclose(getattr(state, name), getattr(twin, name), rtol=1e-9, atol=1e-9, err_msg=name)


def press_both(
    state: State,
    kernel: Callable[[State, int], Any],
    reference: Callable[[State, int], Any],
    *names: str,
    times: int = 5,
) -> None:
    """Let a kernel and its twin press on parcels that fly on: springs stretch, contacts open; compare."""
    twin = deepcopy(state)
    for step in range(times):
        for parcels, act in ((state, kernel), (twin, reference)):
            parcels.forces[:] = 0.0
            parcels.torques[:] = 0.0
            parcels.positions[:] += 0.004 * parcels.velocities
            act(parcels, step)
        assert_same(state, twin, "positions", "velocities", "forces", "torques", *names)
