import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.contact import LARGEST_OVERLAP, SEPARATION_M_S, Law, contact, wall_contact
from validation.soil.reference import contact as reference
from validation.soil.reference.worlds import DT, MASS, RADIUS, STIFFNESS

UP = (0.0, 0.0, 1.0)
LAW = Law(STIFFNESS, 0.5, 0.3)

speeds = st.floats(-12.0, 12.0)
vectors = st.tuples(speeds, speeds, speeds)
springs = st.lists(st.floats(-0.01, 0.01), min_size=6, max_size=6)
laws = st.builds(Law, st.floats(1e3, 3e5), st.floats(0.0, 2.0), st.floats(0.0, 2.0))


def unit(vector):
    length = float(np.linalg.norm(vector))
    return np.array(vector) / length if length > 1e-3 else np.array([0.0, 0.0, 1.0])


@given(
    memory=springs,
    normal=vectors,
    gap=st.floats(0.0, RADIUS),
    velocity=vectors,
    turning=vectors,
    law=laws,
    function=st.sampled_from([contact, wall_contact]),
)
@settings(max_examples=300)
def test_a_contact_is_that_of_the_reference(memory, normal, gap, velocity, turning, law, function):
    n = unit(normal)
    kept, expected = np.array([memory, memory]), np.array(memory)
    found = function(kept, 1, tuple(n), gap, velocity, turning, MASS, RADIUS, law, DT)
    twin = getattr(reference, function.__name__)
    twins = twin(expected, n, gap, np.array(velocity), np.array(turning), MASS, RADIUS, law, DT)
    np.testing.assert_allclose(found, twins, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(kept[1], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(kept[0], memory)  # the other contact is left alone


def separation(closing, overlap, mass):
    """Return the largest speed at which two partners separate that begin head-on, closing and overlapping."""
    memory, still, fastest = np.zeros((1, 6)), (0.0, 0.0, 0.0), 0.0
    while overlap > 0.0:
        force, _ = contact(memory, 0, UP, overlap, (0.0, 0.0, -closing), still, mass, RADIUS, LAW, DT)
        closing -= DT * force[2] / mass
        overlap += DT * closing
        fastest = max(fastest, -closing)
    return fastest


effective_masses = pytest.mark.parametrize("mass", [MASS, MASS / 2], ids=["wall", "pair"])


@effective_masses
def test_a_head_on_collision_takes_energy_at_every_speed(mass):
    """Partners that met slower than 4 m/s part at no more than the separation speed."""
    for speed in np.geomspace(1e-3, 24.0, 60):  # two parcels that each fly at the speed limit meet at 24 m/s
        apart = separation(speed, 1e-9, mass)
        assert 0.0 < apart < 0.3 * speed
        assert apart <= 1.05 * SEPARATION_M_S or speed > 4.0


@effective_masses
@pytest.mark.parametrize("overlap", [0.1, 0.3, 0.5, 1.0, 2.0])
def test_a_sudden_overlap_parts_at_the_separation_speed_or_that_of_one_sub_step(mass, overlap):
    """The force fades with the speed that it has made: it cannot within the first sub-step."""
    push = STIFFNESS * min(overlap, LARGEST_OVERLAP) * RADIUS
    assert separation(0.0, overlap * RADIUS, mass) <= max(SEPARATION_M_S, push * DT / mass) + 1e-9
