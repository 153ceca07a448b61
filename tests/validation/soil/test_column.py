import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil import Soil
from validation.soil.arrangement import cylinder
from validation.soil.column import collapse, mass_radius, sand_with_friction, share_radius
from validation.soil.column_laws import LAJEUNESSE, LUBE, cone_run_out, power_law


@given(seed=st.integers(0, 2**16), radius=st.floats(0.2, 0.5), height=st.floats(0.1, 0.8))
@settings(max_examples=15, deadline=None)
def test_parcels_of_a_column_neither_overlap_nor_start_in_the_floor(seed, radius, height):
    soil = Soil()
    points = cylinder(radius, height, soil, np.random.default_rng(seed))
    apart = np.linalg.norm(points[:, None] - points, axis=2) + 9.0 * np.eye(len(points))
    assert apart.min() >= 2.0 * soil.parcel_radius_m
    assert points[:, 2].min() >= soil.parcel_radius_m
    assert np.hypot(points[:, 0], points[:, 1]).max() <= radius + 0.02


def test_a_column_has_the_bulk_density():
    soil = Soil()
    packing = math.cbrt(math.pi / math.sqrt(18.0) / soil.parameters.parcel_solid_fraction)
    height = 5 * 2.0 * soil.parcel_radius_m * packing * math.sqrt(2.0 / 3.0)  # five layers
    counts = [len(cylinder(0.5, height, soil, np.random.default_rng(seed))) for seed in range(20)]
    found = np.mean(counts) * soil.parcel_mass_kg / (math.pi * 0.5**2 * height)
    assert found == pytest.approx(soil.density_kg_m3, rel=0.01)


@given(prefactor=st.floats(0.1, 5.0), exponent=st.floats(0.1, 2.0))
def test_the_fit_finds_a_power_law(prefactor, exponent):
    x = [0.5, 1.0, 1.5]
    assert power_law(x, [prefactor * a**exponent for a in x]) == pytest.approx((prefactor, exponent))


def test_the_laws_are_those_that_were_published():
    assert [LUBE.run_out(a) for a in (1.0, 4.0)] == pytest.approx([1.24, 3.2])
    assert [LAJEUNESSE.run_out(a) for a in (1.0, 4.0)] == pytest.approx([1.35, 4.0])
    assert (LUBE.height(0.5), LAJEUNESSE.height(2.0)) == (0.5, 0.74)
    assert cone_run_out(1.0, 39.0) == pytest.approx(0.55, abs=0.01)


def test_a_height_field_alone_ends_as_the_cone():
    one = collapse(sand_with_friction(39.0), 0.5, fidelity="fast", seed=0)
    # 99 % of a cone lie within 0.941 of its radius: 3 x^2 - 2 x^3 = 0.99.
    assert 1.0 + one.cone_run_out == pytest.approx(0.941 * (1.0 + cone_run_out(one.aspect, 39.0)), rel=0.02)


def test_the_mass_radius_of_a_disc_and_of_one_parcel():
    radii = np.linspace(0.0, 1.0, 1001)
    assert share_radius(radii, radii, 0.25) == pytest.approx(0.5, abs=1e-3)
    soil = Soil(extent_m=(4.0, 4.0))
    soil.reset((np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij")) < 1.0).astype(float))
    assert mass_radius(soil, 0.99) == pytest.approx(0.995, abs=0.03)
    soil.reset()
    soil.add_parcels([[0.0, 1.5, 1.0]], np.zeros((1, 3)))
    assert mass_radius(soil, 0.5) == pytest.approx(1.5, abs=0.01)
