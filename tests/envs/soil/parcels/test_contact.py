import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.parcels.contact import (
    LARGEST_OVERLAP,
    LARGEST_PHASE,
    SEPARATION_M_S,
    TANGENTIAL_STIFFNESS,
    Law,
    contact,
    normal_force,
    wall_contact,
)
from validation.soil.reference import contact as reference

RADIUS = 0.045
MASS = 0.94
DT = 0.001
STIFFNESS = MASS * (0.2 / DT) ** 2
IMPEDANCE = math.sqrt(STIFFNESS * MASS)
UP = (0.0, 0.0, 1.0)
LAW = Law(STIFFNESS, 0.5, 0.3, 0.0)

speeds = st.floats(-12.0, 12.0)
vectors = st.tuples(speeds, speeds, speeds)
springs = st.lists(st.floats(-0.01, 0.01), min_size=6, max_size=6)
laws = st.builds(Law, st.floats(1e3, 3e5), st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.sampled_from([0.0, 2100.0]))


def unit(vector):
    length = float(np.linalg.norm(vector))
    return np.array(vector) / length if length > 1e-3 else np.array([0.0, 0.0, 1.0])


@given(memory=springs, normal=vectors, overlap=st.floats(0.0, 0.05), velocity=vectors, rolling=vectors, law=laws)
@settings(max_examples=200)
def test_a_contact_is_that_of_the_reference(memory, normal, overlap, velocity, rolling, law):
    n = unit(normal)
    kept, expected = np.array([memory, memory]), np.array(memory)
    force, roll = contact(kept, 1, tuple(n), overlap, velocity, rolling, MASS, RADIUS, law, DT)
    twin = reference.contact(expected, n, overlap, np.array(velocity), np.array(rolling), MASS, RADIUS, law, DT)
    np.testing.assert_allclose(force, twin[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(roll, twin[1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(kept[1], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(kept[0], memory)  # the other contact is left alone


@given(memory=springs, normal=vectors, gap=st.floats(0.0, RADIUS), velocity=vectors, spin=vectors, law=laws)
@settings(max_examples=100)
def test_a_contact_with_a_wall_is_that_of_the_reference(memory, normal, gap, velocity, spin, law):
    n = unit(normal)
    kept, expected = np.array([memory]), np.array(memory)
    force, torque = wall_contact(kept, 0, tuple(n), gap, velocity, spin, MASS, RADIUS, law, DT)
    twin = reference.wall_contact(expected, n, gap, np.array(velocity), np.array(spin), MASS, RADIUS, law, DT)
    np.testing.assert_allclose(force, twin[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(torque, twin[1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(kept[0], expected, rtol=1e-9, atol=1e-12)


def test_the_normal_force_at_rest_is_the_spring_up_to_its_largest_overlap():
    assert normal_force(0.002, 0.0, STIFFNESS, IMPEDANCE, RADIUS) == pytest.approx(0.002 * STIFFNESS)
    largest = LARGEST_OVERLAP * RADIUS * STIFFNESS
    for overlap in (LARGEST_OVERLAP * RADIUS, RADIUS, 2 * RADIUS):
        assert normal_force(overlap, 0.0, STIFFNESS, IMPEDANCE, RADIUS) == pytest.approx(largest)


@given(normal=vectors, velocity=vectors, rolling=vectors, memory=springs, law=laws)
@settings(max_examples=100)
def test_sliding_and_rolling_forces_are_tangential_and_at_most_friction(normal, velocity, rolling, memory, law):
    n = unit(normal)
    kept, overlap = np.array([memory]), 0.003
    force, roll = contact(kept, 0, tuple(n), overlap, velocity, rolling, MASS, RADIUS, law, DT)
    stiffness = min(law.stiffness, MASS * (LARGEST_PHASE / DT) ** 2)
    pressing = reference.normal_force(overlap, float(n @ velocity), stiffness, MASS, RADIUS)
    slide = force - float(n @ force) * n
    assert np.linalg.norm(slide) <= law.sliding * pressing + 1e-9
    assert np.linalg.norm(roll) <= law.rolling * pressing + 1e-9
    assert n @ roll == pytest.approx(0.0, abs=1e-9)
    assert np.abs(kept[0].reshape(2, 3) @ n).max() < 1e-12


def test_a_sticking_contact_pulls_back_to_where_it_began_and_a_sliding_one_does_not():
    overlap = 0.003
    limit = LAW.sliding * STIFFNESS * overlap
    stretch = limit / (TANGENTIAL_STIFFNESS * STIFFNESS)
    still = (0.0, 0.0, 0.0)
    for share in (0.5, 3.0):
        memory = np.zeros((1, 6))
        slowly = (share * stretch / (1000 * DT), 0.0, 0.0)
        for _ in range(1000):
            contact(memory, 0, UP, overlap, slowly, still, MASS, RADIUS, LAW, DT)
        force, _ = contact(memory, 0, UP, overlap, still, still, MASS, RADIUS, LAW, DT)
        assert force[0] == pytest.approx(-min(share, 1.0) * limit)


def test_cohesion_is_a_pull_over_the_cross_section_and_adds_no_friction():
    sticky = LAW._replace(cohesion=2100.0)
    memory, still = np.zeros((2, 6)), (0.0, 0.0, 0.0)
    free, _ = contact(memory, 0, UP, 0.002, (1.0, 0.0, 0.0), still, MASS, RADIUS, LAW, DT)
    held, _ = contact(memory, 1, UP, 0.002, (1.0, 0.0, 0.0), still, MASS, RADIUS, sticky, DT)
    assert free[2] - held[2] == pytest.approx(2100.0 * math.pi * RADIUS**2)
    assert held[0] == pytest.approx(free[0])


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
closing_speeds = np.geomspace(1e-3, 24.0, 60)
"""Two parcels that each fly at the speed limit meet at 24 m/s."""


@effective_masses
def test_a_head_on_collision_takes_energy_at_every_speed(mass):
    for speed in closing_speeds:
        assert 0.0 < separation(speed, 1e-9, mass) < 0.3 * speed


@effective_masses
def test_partners_that_met_slower_than_4_m_s_part_at_no_more_than_the_separation_speed(mass):
    for speed in closing_speeds[closing_speeds <= 4.0]:
        assert separation(speed, 1e-9, mass) <= 1.05 * SEPARATION_M_S


@effective_masses
@pytest.mark.parametrize("overlap", [0.1, 0.3, 0.5, 1.0, 2.0])
def test_a_sudden_overlap_parts_at_the_separation_speed_or_that_of_one_sub_step(mass, overlap):
    """The force fades with the speed that it has made: it cannot within the first sub-step."""
    push = STIFFNESS * min(overlap, LARGEST_OVERLAP) * RADIUS
    assert separation(0.0, overlap * RADIUS, mass) <= max(SEPARATION_M_S, push * DT / mass) + 1e-9
