import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.parcels.joining import CROWDED, JOINED, MOST_JOINED, STAYS, WITHOUT_ROOM, join
from lerobot_excav.envs.soil.soil import Soil
from validation.soil.reference.worlds import RADIUS


@given(seed=st.integers(0, 2**16), free=st.integers(0, 15), apart=st.booleans())
@settings(max_examples=60)
def test_what_joins_keeps_mass_momentum_and_centre_and_nothing_grows_beyond_the_bound(seed, free, apart):
    rng = np.random.default_rng(seed)
    positions, velocities = rng.uniform(-0.2, 0.2, (40, 3)), rng.normal(0.0, 1.0, (40, 3))
    masses, asleep = rng.uniform(0.5, 1.0, 40), (rng.random(20) < 0.3).astype(np.uint8)
    points, moving, grown = positions.copy(), velocities.copy(), masses.copy()
    radii = RADIUS * np.cbrt(masses)
    fate = join(points, moving, grown, radii, asleep, free, MOST_JOINED, CROWDED if apart else 0.0)
    np.testing.assert_allclose(radii, RADIUS * np.cbrt(grown))
    kept, there = fate != WITHOUT_ROOM, fate == STAYS
    assert grown.max() <= MOST_JOINED
    assert there[:20].all()
    assert there[20:].sum() <= free
    np.testing.assert_array_equal(grown[:20][asleep == 1], masses[:20][asleep == 1])
    assert grown[there].sum() == pytest.approx(masses[kept].sum(), rel=1e-13)
    np.testing.assert_allclose(grown[there] @ points[there], masses[kept] @ positions[kept], atol=1e-12)
    np.testing.assert_allclose(grown[there] @ moving[there], masses[kept] @ velocities[kept], atol=1e-12)


def test_a_parcel_beyond_the_bound_joins_the_nearest_one_that_is_not_full():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])
    masses, asleep = np.array([3.0, 1.0, 1.0, 1.0]), np.zeros(2, dtype=np.uint8)
    fate = join(points, np.zeros((4, 3)), masses, np.ones(4), asleep, 0, MOST_JOINED, 0.0)
    np.testing.assert_array_equal(fate, [STAYS, STAYS, JOINED, JOINED])
    np.testing.assert_allclose(masses[:2], [4.0, 2.0])  # the first is full after one


@pytest.mark.parametrize("size_m", [0.0, 0.4, 2.0])
def test_thousands_of_parcels_stay_few_small_and_apart_and_every_kilogram_is_somewhere(size_m):
    """Counts of the work of a step, not its time: parcels awake, and neighbours of each."""
    soil = Soil(fidelity="fast")
    soil.reset(np.full((120, 120), 0.1))
    before = sum(soil.ledger_kg().values())
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (6000, 3)) * size_m + [0.0, 0.0, 2.0]
    soil.add_parcels(points, np.zeros_like(points))
    whole = soil.parcel_mass_kg
    for _ in range(5):
        assert sum(soil.ledger_kg().values()) == pytest.approx(before + 6000 * whole, abs=1e-6)
        assert soil.awake_parcel_count <= soil.fidelity.most_awake
        assert soil.parcel_masses_kg.max() <= MOST_JOINED * whole + 1e-9
        soil.step(TICK_S)
        pairs, count = soil._loose.population._pairs, len(soil.parcel_masses_kg)
        assert pairs.start[count] <= 30 * count


def test_parcels_that_begin_side_by_side_are_left_alone():
    soil = Soil()
    points = 2.1 * CROWDED * soil.parcel_radius_m * np.array(list(np.ndindex(4, 4, 4)), dtype=float) + [0.0, 0.0, 1.0]
    soil.add_parcels(points, np.zeros_like(points))
    np.testing.assert_array_equal(soil.parcel_positions_w, points)
