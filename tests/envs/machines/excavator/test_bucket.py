import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.soil.bucket import heaped_volume_m3

GEOMETRY = bucket_geometry()


def test_heaped_volume_is_that_of_the_datasheet_and_holds_as_much_sand_as_published():
    volume_m3 = heaped_volume_m3(GEOMETRY, slope_tan=1.0)
    assert volume_m3 == pytest.approx(const.BUCKET_HEAPED_VOLUME_M3, rel=0.005)
    assert 1474.0 * volume_m3 == pytest.approx(485.0, rel=0.05)


def test_struck_volume_follows_from_the_cross_section():
    area_m2 = -np.trapezoid(*GEOMETRY.profile_t.T[::-1])  # from the edge at large x to the lip
    assert GEOMETRY.struck_volume_m3 == pytest.approx(area_m2 * GEOMETRY.inner_width_m)
    assert GEOMETRY.struck_volume_m3 == pytest.approx(0.2584, abs=0.001)


def test_profile_runs_from_the_edge_at_45_degrees_to_the_lip_on_the_opening_line():
    edge, end, *inner, lip = GEOMETRY.profile_t
    np.testing.assert_array_equal(edge, [const.BUCKET_LENGTH_M, 0.0])
    assert lip[1] == 0.0
    assert all(point[1] > 0 for point in (end, *inner))
    assert np.degrees(np.arctan2(end[1] - edge[1], edge[0] - end[0])) == pytest.approx(45.0, abs=1.0)
