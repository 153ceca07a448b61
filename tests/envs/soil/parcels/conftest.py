"""Small worlds of parcels: makers of states, tools and sites for the tests of this directory."""

import math
from copy import deepcopy

import numpy as np
import pytest

from bench.soil import BUCKET, rotation_at
from lerobot_excav.envs.soil.height_field import Grid
from lerobot_excav.envs.soil.motion import Pose, path
from lerobot_excav.envs.soil.parcels.contact import Law
from lerobot_excav.envs.soil.parcels.dynamics import Laws, advance
from lerobot_excav.envs.soil.parcels.ground import Site
from lerobot_excav.envs.soil.parcels.pairs import room_for
from lerobot_excav.envs.soil.parcels.plates import NO_BOX, ToolPath
from lerobot_excav.envs.soil.parcels.population import Population
from lerobot_excav.envs.soil.parcels.store import WALLS, empty_state

RADIUS = 0.045
MASS = 0.94
DT = 0.001
STIFFNESS = MASS * (0.2 / DT) ** 2
PLATES = len(BUCKET.profile_t) + 1 + WALLS


@pytest.fixture(scope="session")
def laws():
    return Laws(Law(STIFFNESS, 0.5, 0.3, 0.0), Law(STIFFNESS, 0.97, 0.6, 0.0), Law(STIFFNESS, 0.49, 0.3, 0.0))


@pytest.fixture(scope="session")
def make_state():
    """Return a maker of parcels from positions (n, 3) and any other array of a state by name."""

    def make(positions, **arrays):
        state = empty_state(len(positions), PLATES)
        state.positions[:] = positions
        state.radii[:] = RADIUS
        state.masses[:] = MASS
        for name, value in arrays.items():
            getattr(state, name)[:] = value
        return state

    return make


@pytest.fixture(scope="session")
def random_state(make_state):
    """Return a maker of n parcels of different sizes that move and spin in a box of some size."""

    def make(rng, count, half_size, centre=(0.0, 0.0, 0.0)):
        radii = RADIUS * rng.uniform(0.7, 1.4, count)
        return make_state(
            np.asarray(centre) + rng.uniform(-1.0, 1.0, (count, 3)) * half_size,
            velocities=rng.normal(0.0, 1.0, (count, 3)),
            spins=rng.normal(0.0, 10.0, (count, 3)),
            radii=radii,
            masses=MASS * (radii / RADIUS) ** 3,
        )

    return make


@pytest.fixture(scope="session")
def tool_path():
    """Return a maker of a bucket's path from one position and pitch to another in some steps."""

    def make(position=(0.0, 0.0, 0.0), pitch=math.pi, travel=(0.0, 0.0, 0.0), turn=0.0, steps=1, dt=DT):
        start = np.asarray(position, dtype=np.float64)
        before = Pose(position=start, rotation=rotation_at(pitch))
        now = Pose(position=start + np.asarray(travel), rotation=rotation_at(pitch + turn))
        positions, rotations, turned = path(before, now, steps)
        duration = steps * dt
        return ToolPath(
            1,
            BUCKET.profile_t,
            BUCKET.planes_t,
            0.5 * float(BUCKET.inner_width_m),
            positions,
            rotations,
            (now.position - before.position) / duration,
            turned / duration,
        )

    return make


@pytest.fixture(scope="session")
def no_tool(tool_path):
    """Return a maker of the absence of a bucket for some sub-steps."""
    return lambda steps: tool_path(steps=steps)._replace(present=0)


@pytest.fixture(scope="session")
def site():
    """Return a maker of level ground of some height, 6 m x 6 m, with or without a box."""

    def make(height=0.0, heights=None, box=NO_BOX, box_heights=None):
        cells = np.full((60, 60), height) if heights is None else np.asarray(heights, dtype=np.float64)
        cell = 6.0 / len(cells)
        inside = np.zeros((8, 6)) if box_heights is None else box_heights
        size = 2.0 * box.half_x / inside.shape[0], 2.0 * box.half_y / inside.shape[1]
        return Site(
            cells, Grid.centred(cells.shape, cell, cell), inside, Grid.centred(inside.shape, *size), box, height
        )

    return make


@pytest.fixture(scope="session")
def assert_same():
    """Return what compares fields of two states, flags exactly."""

    def check(state, twin, *names):
        for name in names:
            np.testing.assert_allclose(getattr(state, name), getattr(twin, name), rtol=1e-9, atol=1e-9, err_msg=name)

    return check


@pytest.fixture(scope="session")
def press_both(assert_same):
    """Return what lets a kernel and its twin press on parcels that fly on: springs stretch, contacts open."""

    def press(state, kernel, reference, *names, times=5):
        twin = deepcopy(state)
        for step in range(times):
            for parcels, act in ((state, kernel), (twin, reference)):
                parcels.forces[:] = 0.0
                parcels.torques[:] = 0.0
                parcels.positions[:] += 0.004 * parcels.velocities
                act(parcels, step)
            assert_same(state, twin, "positions", "velocities", "forces", "torques", *names)

    return press


@pytest.fixture(scope="session")
def make_population(laws):
    """Return a maker of empty populations."""

    def make(most_awake=1000, laws=laws):
        return Population(PLATES, laws, RADIUS, MASS, most_awake)

    return make


@pytest.fixture(scope="session")
def run(no_tool, site, laws):
    """Return what advances a state by some sub-steps in one call and tells the fastest hit on a sleeping parcel."""

    def run(state, steps, ground=None, tool=None, laws=laws):
        count = len(state.masses)
        new = np.full(count, -1, dtype=np.int64)
        world = (tool or no_tool(steps), ground or site(), laws)
        return advance(state, room_for(count), room_for(count), new, *world, DT, steps)[2]

    return run
