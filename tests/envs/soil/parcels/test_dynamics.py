import math
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.parcels.contact import LARGEST_OVERLAP, SEPARATION_M_S, Law
from lerobot_excav.envs.soil.parcels.dynamics import LARGEST_SPEED_M_S, advance
from lerobot_excav.envs.soil.parcels.pairs import room_for
from lerobot_excav.envs.soil.parcels.plates import BoxWalls
from validation.soil.reference import motion as reference
from validation.soil.reference.plates import bucket_polygons, nearest_point
from validation.soil.reference.worlds import (
    DT,
    LAWS,
    MASS,
    RADIUS,
    STIFFNESS,
    assert_same,
    make_state,
    no_tool,
    random_state,
    run,
    site,
    tool_path,
)

BOX = BoxWalls(0.4, 0.1, 0.0, 0.5, 0.4, 0.5, math.cos(0.3), math.sin(0.3))
WEIGHT = np.array([0.0, 0.0, -GRAVITY_M_S2])


def energy(state):
    spinning = 0.4 * state.masses * state.radii**2 * (state.spins**2).sum(axis=1)
    moving = state.masses * (state.velocities**2).sum(axis=1)
    return float(0.5 * (moving + spinning).sum() + GRAVITY_M_S2 * state.masses @ state.positions[:, 2])


@pytest.mark.slow
@given(seed=st.integers(0, 2**16), has_tool=st.booleans())
@settings(max_examples=25)
def test_sub_steps_are_those_of_the_reference(seed, has_tool):
    """A crowd in a moving bucket above a box and rough ground: all contacts at once, one parcel too fast."""
    rng, steps = np.random.default_rng(seed), 8
    tool = tool_path((0.8, 0.0, 0.3), -2.6, [0.01, 0.0, 0.01], 0.02, steps)._replace(present=int(has_tool))
    ground = site(heights=rng.uniform(0.0, 0.3, (30, 30)), box=BOX, box_heights=rng.uniform(0, 0.1, (8, 6)))
    state = random_state(rng, 16, [0.5, 0.3, 0.2], centre=(0.3, 0.0, 0.25))
    state.velocities[0, 2] = 1.1 * LARGEST_SPEED_M_S
    if has_tool:
        state.asleep[:] = rng.random(16) < 0.25
        state.places_t[:] = (state.positions - tool.positions[0]) @ tool.rotations[0]
    twin = deepcopy(state)
    hit = run(state, steps, ground, tool)
    assert hit == pytest.approx(reference.advance(twin, {}, tool, ground, LAWS, DT, steps, np.zeros(6)), abs=1e-9)
    assert_same(state, twin, "positions", "velocities", "spins", "ground_springs", "plate_springs", "ground", "shell")
    assert np.linalg.norm(state.velocities, axis=1).max() <= LARGEST_SPEED_M_S + 1e-9


@given(seed=st.integers(0, 2**16))
@settings(max_examples=30)
def test_free_parcels_keep_their_momentum_and_their_spin_about_the_centre_of_mass(seed):
    """Angular momentum holds to first order: positions move between the forces of two sub-steps."""
    state = random_state(np.random.default_rng(seed), 10, 0.08, centre=(0.0, 0.0, 50.0))
    total = state.masses.sum()

    def about_centre():
        arms = state.positions - state.masses @ state.positions / total
        orbits = np.cross(arms, state.masses[:, None] * (state.velocities - momentum() / total))
        own = 0.4 * (state.masses * state.radii**2)[:, None] * state.spins
        return np.asarray((orbits + own).sum(axis=0))

    def momentum():
        return np.asarray(state.masses @ state.velocities)

    before, turning, scale = momentum(), about_centre(), np.abs(state.spins).sum() * MASS * RADIUS**2
    run(state, 40)
    np.testing.assert_allclose(momentum(), before + total * WEIGHT * 40 * DT, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(about_centre(), turning, atol=1e-9 * scale + 1e-9)


def roll(angle, sliding, rolling, steps):
    """Lay a parcel at rest on a long slope and give it some time; return it and where it began."""
    x = np.linspace(-2.95, 2.95, 60)
    ground = site(heights=np.repeat((3.0 - x * math.tan(angle))[:, None], 60, axis=1))
    foot = np.array([-2.0, 0.0, 3.0 + 2.0 * math.tan(angle)])
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    start = foot + (RADIUS - MASS * GRAVITY_M_S2 * math.cos(angle) / STIFFNESS) * normal
    state = make_state([start])
    run(state, steps, ground, laws=LAWS._replace(ground=Law(STIFFNESS, sliding, rolling)))
    return state, start


@pytest.mark.parametrize("friction_deg", [20.0, 35.0])
def test_a_parcel_that_cannot_roll_sticks_below_the_friction_angle_and_slides_above_as_coulomb_says(friction_deg):
    friction = math.tan(math.radians(friction_deg))
    state, start = roll(math.radians(friction_deg - 1.0), friction, 10.0, 1000)
    assert np.abs(state.positions - start).max() < 0.006  # the springs of sliding and rolling stretch
    assert np.linalg.norm(state.velocities[0]) < 1e-3
    angle = math.radians(friction_deg + 2.0)
    speeds = [np.linalg.norm(roll(angle, friction, 10.0, steps)[0].velocities[0]) for steps in (400, 800)]
    pull = GRAVITY_M_S2 * (math.sin(angle) - friction * math.cos(angle))
    assert speeds[1] - speeds[0] == pytest.approx(0.4 * pull, rel=0.02)


@pytest.mark.parametrize("rolling", [0.2, 0.5])
def test_a_parcel_rolls_above_the_angle_of_rolling_friction_and_not_below(rolling):
    below, _ = roll(math.atan(rolling) - 0.02, 2.0, rolling, 800)
    above, _ = roll(math.atan(rolling) + 0.05, 2.0, rolling, 800)
    assert np.linalg.norm(below.velocities[0]) < 1e-3
    speed = float(np.linalg.norm(above.velocities[0]))
    assert speed > 0.1
    assert above.spins[0, 1] * RADIUS == pytest.approx(speed, rel=0.05)  # it rolls, it does not slide


@pytest.mark.parametrize("rolling", [0.1, 0.3])
def test_rolling_friction_stops_a_rolling_parcel_after_the_way_of_its_energy(rolling):
    """7/10 m v^2 is used up by the force mu_r m g along the way."""
    start, speed = [-2.0, 0.0, RADIUS - MASS * GRAVITY_M_S2 / STIFFNESS], 1.0
    state = make_state([start], velocities=[[speed, 0.0, 0.0]], spins=[[0.0, speed / RADIUS, 0.0]])
    run(state, 2000, laws=LAWS._replace(ground=Law(STIFFNESS, 1.0, rolling)))
    assert np.linalg.norm(state.velocities[0]) < 1e-3
    assert state.positions[0, 0] + 2.0 == pytest.approx(0.7 * speed**2 / (rolling * GRAVITY_M_S2), rel=0.1)


def test_a_stack_stays_at_rest_and_its_energy_does_not_grow():
    """A square pyramid of spheres that just touch."""
    layers = [(2 * i + level, 2 * j + level, level) for level in range(3) for i, j in np.ndindex(3 - level, 3 - level)]
    state = make_state(RADIUS * (np.array(layers) * [1.0, 1.0, math.sqrt(2.0)] + [0.0, 0.0, 1.0]))
    run(state, 500)  # it sinks into its springs
    rest, energies = state.positions.copy(), [energy(state)]
    for _ in range(20):
        run(state, 100)
        energies.append(energy(state))
    assert np.abs(state.positions - rest).max() < 0.02 * RADIUS
    assert np.linalg.norm(state.velocities, axis=1).max() < 0.01
    assert max(energies) <= energies[0] + 1e-4


def test_what_contacts_remember_outlives_new_lists_of_neighbours(rng):
    """A heap slides along a smooth gutter: the list is made again and again, contacts under weight stay closed.

    The twin has no list: it looks at all pairs and forgets only what opens.
    """
    across = np.linspace(-2.95, 2.95, 60)
    gutter = site(heights=np.repeat(np.abs(across)[None, :], 60, axis=0))
    rows_x = 1.98 * RADIUS * np.arange(8) - 2.0
    lower, upper = (np.column_stack([rows_x, np.zeros(8), np.full(8, z)]) for z in (1.42 * RADIUS, 3.38 * RADIUS))
    state = make_state(np.concatenate([lower, upper]))
    state.velocities[:] = np.array([4.0, 0.0, 0.0]) + rng.normal(0.0, 0.01, (16, 3))
    state.spins[:] = rng.normal(0.0, 0.5, (16, 3))
    smooth = LAWS._replace(ground=Law(STIFFNESS, 0.0, 0.0))
    twin, memory = deepcopy(state), {}
    anchor, made = state.positions.copy(), 0
    pairs, spare, rows = room_for(16), room_for(16), np.full(16, -1, dtype=np.int64)
    for _ in range(60):
        pairs, spare, _ = advance(state, pairs, spare, rows, no_tool(5), gutter, smooth, DT, 5, np.zeros(6))
        rows = np.arange(16)
        made += not np.array_equal(pairs.anchors[:16], anchor)
        anchor = pairs.anchors[:16].copy()
        reference.advance(twin, memory, no_tool(5), gutter, smooth, DT, 5, np.zeros(6))
    assert made > 20
    assert sum(np.abs(springs[:3]).max() > 1e-6 for springs in memory.values()) >= 8
    np.testing.assert_allclose(state.positions, twin.positions, atol=1e-9)
    np.testing.assert_allclose(state.spins, twin.spins, rtol=1e-7, atol=1e-7)


def crosses(polygon, start, end):
    """Tell whether a straight way crosses a convex polygon."""
    normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
    before, after = (start - polygon[0]) @ normal, (end - polygon[0]) @ normal
    if before * after >= 0.0:
        return False
    point = start + before / (before - after) * (end - start)
    turns = np.cross(np.roll(polygon, -1, axis=0) - polygon, point - polygon) @ normal
    return bool((turns > 0).all() or (turns < 0).all())


@pytest.mark.slow
@given(seed=st.integers(0, 2**16))
@settings(max_examples=12)
def test_no_parcel_passes_a_plate_at_the_largest_speed(seed):
    """Thrown at the bucket from all sides, while that moves as fast as sub-steps allow."""
    rng, steps, count = np.random.default_rng(seed), 25, 40
    way = rng.normal(0.0, 1.0, 3)
    travel = steps * 0.2 * RADIUS * way / np.linalg.norm(way)
    whole = tool_path((0.0, 0.0, 5.0), rng.uniform(-3.1, 3.1), travel, 0.0, steps)
    plates = bucket_polygons(whole)
    aims = np.array([rng.dirichlet(np.ones(len(p))) @ p for p in (plates[k % len(plates)] for k in range(count))])
    flight = rng.normal(0.0, 1.0, (count, 3))
    flight /= np.linalg.norm(flight, axis=1)[:, None]
    starts = aims - rng.uniform(1.0, 3.0, (count, 1)) * RADIUS * flight
    keep = [min(np.linalg.norm(q - nearest_point(plate, q)) for plate in plates) > 0.5 * RADIUS for q in starts]
    rotation = whole.rotations[0]
    state = make_state(
        whole.positions[0] + starts[keep] @ rotation.T, velocities=LARGEST_SPEED_M_S * flight[keep] @ rotation.T
    )
    for step in range(steps):
        tool = whole._replace(positions=whole.positions[step : step + 2], rotations=whole.rotations[:2])
        before = (state.positions - tool.positions[0]) @ rotation
        run(state, 1, tool=tool)
        after = (state.positions - tool.positions[1]) @ rotation
        for a, b in zip(before, after, strict=True):
            assert not any(crosses(plate, a, b) for plate in plates)


@pytest.mark.parametrize("distance", [0.0, 0.01, 0.5, 1.0, 1.8])
def test_parcels_born_into_each_other_part_without_a_bang(rng, distance):
    """Two part at the separation speed; only the push of the first sub-step cannot know yet what speed it makes.

    In a crowd at one place (distance 0), the pushes of all 20 add up in that sub-step, to near the speed limit.
    """
    pair = np.array([[0.0, 0.0, 50.0], [distance * RADIUS, 0.0, 50.0]])
    crowd = pair[0] + rng.uniform(-0.1, 0.1, (20, 3)) * RADIUS
    state, fastest = make_state(pair if distance else crowd), 0.0
    for _ in range(400):
        run(state, 1)
        drift = state.velocities - state.velocities.mean(axis=0)
        fastest = max(fastest, float(np.linalg.norm(drift, axis=1).max()))
    first_push = min(2.0 - distance, LARGEST_OVERLAP) * RADIUS * STIFFNESS * DT / MASS
    assert fastest <= (max(0.5 * SEPARATION_M_S, first_push) + 1e-9 if distance else 1.1 * LARGEST_SPEED_M_S)
    apart = np.linalg.norm(state.positions[:, None] - state.positions[None], axis=2) + np.eye(len(state.masses))
    assert apart.min() >= (2.0 if distance else 1.9) * RADIUS
    assert np.abs(state.velocities[:, :2].mean(axis=0)).max() < 0.2


@pytest.mark.parametrize("share", [1.0, 0.3, 0.1, 0.03, 1e-2, 1e-4, 1e-8])
def test_a_light_remainder_lands_as_softly_as_a_whole_parcel(share):
    """A stiffness made for whole parcels would shoot it to the sky."""
    state = make_state([[0.0, 0.0, 0.5]], radii=RADIUS * share ** (1.0 / 3.0), masses=MASS * share)
    energies = [energy(state)]
    for _ in range(900):
        run(state, 1)
        energies.append(energy(state))
    assert max(energies) == energies[0]
    assert max(energies[400:]) < 0.1 * energies[0]
    assert state.positions[0, 2] < RADIUS
    assert np.linalg.norm(state.velocities[0]) < 0.01
