import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.forces import soil_strength
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.soil.wedge import EDGE_THICKNESS_M, edge_bearing, edge_limits, table_row, wedge_area
from validation.soil.reference import wedge as reference
from validation.soil.reference.worlds import flat

SAND = soil_strength(PRESETS["sand"])
AHEAD = (-1.0, 0.0)


def limits(field, edges, weighed=None, rake_deg=40.0):
    weighed = field.heights if weighed is None else weighed
    rake = math.radians(rake_deg)
    return edge_limits(field.heights, weighed, field.grid, np.array(edges), rake, AHEAD, 0.7, SAND)


EDGE = [[0.0, 0.0, 0.7]]


@given(failure=st.floats(0.25, 0.6), slope=st.floats(-0.4, 0.2), depth=st.floats(0.05, 0.5))
@settings(max_examples=30)
def test_the_wedge_on_a_slope_is_weighed_exactly(failure, slope, depth):
    assume(depth < 2.7 * (math.tan(failure) - slope))  # the failure plane surfaces within the field
    field = flat()
    field.heights[:] = (1.0 - slope * (field.centres(0)))[:, None]
    found = wedge_area(field.heights, field.grid, (0.0, 0.0, 1.0 - depth), AHEAD, failure)
    reach = np.arange(0.0, 2.9, 0.001)
    expected = reference.wedge_area(depth + slope * np.maximum(reach, 0.05), 0.001, failure)
    assert found == pytest.approx(expected, rel=0.03)


def test_rakes_beyond_the_table_count_as_its_ends():
    for inside, outside in ((20.0, -30.0), (90.0, 100.0), (90.0, 170.0)):
        found, expected = (table_row(SAND.table, math.radians(rake)) for rake in (outside, inside))
        assert found == pytest.approx(expected)
    for inside, outside in ((90.0, 120.0), (20.0, 5.0)):
        found = limits(flat(), EDGE, rake_deg=outside)[0]
        assert found == pytest.approx(limits(flat(), EDGE, rake_deg=inside)[0])


def test_each_slice_has_the_soil_before_it():
    field = flat()
    field.heights[:, 60:] += 0.2
    wedges, bearings = limits(field, [[0.0, -0.5, 0.8], [0.0, 0.5, 0.8]])
    assert wedges[1] > 3.0 * wedges[0] > 0.0
    assert bearings[1] > bearings[0] > 0.0


def test_loose_soil_on_the_ground_weighs_on_the_wedge_but_does_not_bury_the_edge():
    field = flat()
    weighed = field.heights + 0.1
    plain, loaded = limits(field, EDGE), limits(field, EDGE, weighed)
    assert loaded[0][0] > 1.3 * plain[0][0]
    assert loaded[1][0] == plain[1][0]
    assert not np.any(limits(field, [[0.0, 0.0, 1.05]], weighed))


def test_an_edge_outside_of_the_field_meets_nothing():
    assert not np.any(limits(flat(), [[3.5, 0.0, 0.5], [0.0, -3.2, 0.5]]))


def test_the_bearing_starts_from_zero_and_grows():
    depths = np.linspace(0.0, 0.6, 400)
    found = np.array([edge_bearing(depth, 0.7, SAND) for depth in depths])
    assert found[0] == 0.0
    assert (np.diff(found) > 0).all()
    assert np.diff(found).max() < 0.02 * found[-1]


def test_cohesion_adds_its_term_to_the_bearing():
    sticky = SAND._replace(cohesion=2000.0)
    more = edge_bearing(0.3, 0.7, sticky) - edge_bearing(0.3, 0.7, SAND)
    area = (EDGE_THICKNESS_M + 5 * 0.06 * 0.015 / 0.7) * 0.7
    assert more == pytest.approx(2000.0 * SAND.bearing_cohesion * area)
    assert SAND.bearing_cohesion == pytest.approx((SAND.bearing_depth - 1.0) / math.tan(SAND.friction))
