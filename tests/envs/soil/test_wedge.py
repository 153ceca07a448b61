import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.forces import blade_force_n, soil_strength
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.wedge import edge_limits, failure_angle_at, passive_force, read_profile, wedge_end
from validation.soil.reference import wedge as reference
from validation.soil.reference.worlds import flat

SAND = soil_strength(PRESETS["sand"])
AHEAD = (-1.0, 0.0)
EDGE = [[0.0, 0.0, 0.7]]


def limits(field, edges, weighed=None, rake_deg=40.0, opening_deg=85.0, load=0.0):
    weighed = field.heights if weighed is None else weighed
    rakes = math.radians(rake_deg), math.radians(opening_deg)
    return edge_limits(field.heights, weighed, field.grid, np.array(edges), rakes, AHEAD, 0.7, load, SAND)


@given(failure=st.floats(0.25, 0.6), slope=st.floats(-0.4, 0.2), depth=st.floats(0.05, 0.5))
@settings(max_examples=30)
def test_the_wedge_on_a_slope_is_weighed_exactly(failure, slope, depth):
    assume(depth < 2.7 * (math.tan(failure) - slope))  # the failure plane surfaces within the field
    field = flat()
    field.heights[:] = (1.0 - slope * (field.centres(0)))[:, None]
    foot, profile = (0.0, 0.0, 1.0 - depth), np.zeros(80)
    known = read_profile(field.heights, field.grid, foot, AHEAD, profile, 0, 58)
    found, length, more = wedge_end(profile, known, 0.05, math.tan(failure), math.inf)
    assert more == 0
    reach = np.arange(0.0, 2.9, 0.001)
    expected = reference.wedge_area(depth + slope * np.maximum(reach, 0.05), 0.001, failure)
    assert found == pytest.approx(expected, rel=0.03)
    assert length == pytest.approx(depth / (math.tan(failure) - slope), rel=0.02)


@given(
    rake=st.floats(0.4, 1.57),
    depth=st.floats(0.0, 0.3),
    heap=st.floats(0.25, 0.5),
    load=st.floats(0.0, 5e3),
    azimuth=st.floats(0.0, 6.28),
)
@settings(max_examples=15)
def test_the_soil_before_a_face_fails_on_the_plane_that_needs_least_also_with_a_heap_and_a_load(
    rake, depth, heap, load, azimuth
):
    ahead = math.cos(azimuth), math.sin(azimuth)
    field = flat()
    x, y = np.meshgrid(field.centres(0), field.centres(1), indexing="ij")
    field.heights[:] += np.clip(heap - 0.8 * np.clip(x * ahead[0] + y * ahead[1] - 0.05, 0.0, None), 0.0, None)
    foot = (0.0, 0.0, 1.0 - depth)
    found, _ = passive_force(field.heights, field.grid, foot, ahead, rake, load, SAND)
    expected = reference.least_force_n_m(
        lambda reach: depth + np.clip(heap - 0.8 * np.maximum(reach - 0.05, 0.0), 0.0, None),
        rake,
        SAND.friction,
        SAND.steel_friction,
        SAND.unit_weight,
        load,
    )
    assert found == pytest.approx(expected, rel=0.06, abs=10.0)


def test_rakes_beyond_the_table_count_as_its_ends():
    for inside, outside in ((20.0, -30.0), (90.0, 100.0), (90.0, 170.0)):
        found, expected = (failure_angle_at(SAND.table, math.radians(rake)) for rake in (outside, inside))
        assert found == pytest.approx(expected)
    for inside, outside in ((90.0, 120.0), (20.0, 5.0)):
        assert limits(flat(), EDGE, rake_deg=outside) == pytest.approx(limits(flat(), EDGE, rake_deg=inside))


def test_each_slice_has_the_soil_before_it():
    field = flat()
    field.heights[:, 60:] += 0.2
    wedges = limits(field, [[0.0, -0.5, 0.8], [0.0, 0.5, 0.8]])
    assert wedges[1] > 3.0 * wedges[0] > 0.0


def test_loose_soil_on_the_ground_weighs_on_the_wedge_but_does_not_bury_the_edge():
    field = flat()
    weighed = field.heights + 0.1
    assert limits(field, EDGE, weighed)[0] > 1.3 * limits(field, EDGE)[0]
    assert not np.any(limits(field, [[0.0, 0.0, 1.05]], weighed))


def test_an_edge_outside_of_the_field_meets_nothing():
    assert not np.any(limits(flat(), [[3.5, 0.0, 0.5], [0.0, -3.2, 0.5]], load=1e3))


def test_the_load_weighs_on_the_cut_until_bucket_and_load_push_the_soil_as_one_body():
    """Steadily, by W sin(b + phi) / sin(rake + delta + b + phi) at first; and a bucket on the ground drags no load."""
    loads = np.linspace(0.0, 8e3, 81)
    found = np.array([limits(flat(), EDGE, rake_deg=30.0, load=load)[0] for load in loads])
    steps = np.diff(found)
    assert (steps >= 0.0).all()
    failure = math.radians(31.4)  # at a rake of 30 degrees; table of the experiment earthmoving_factors
    balance = math.sin(failure + SAND.friction) / math.sin(
        math.radians(30.0) + SAND.steel_friction + failure + SAND.friction
    )
    assert steps[0] == pytest.approx(100.0 * balance, rel=0.02)
    assert steps[-1] == 0.0
    assert steps.max() <= 1.01 * steps[0]
    assert limits(flat(), [[0.0, 0.0, 0.999]], rake_deg=30.0, load=5e3)[0] < 1.0


def test_soil_so_rough_that_it_locks_before_an_upright_blade_holds_a_finite_force():
    rough = dataclasses.replace(PRESETS["sand"], friction_angle_rad=1.2, steel_friction_angle_rad=1.2)
    assert np.isfinite(blade_force_n(rough, 0.2, math.radians(90.0), 0.7)).all()
