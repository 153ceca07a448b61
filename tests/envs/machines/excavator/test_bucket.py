import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.soil.bucket import heaped_volume_m3


def test_heaped_volume_is_that_of_the_datasheet():
    assert heaped_volume_m3(bucket_geometry(), slope_tan=1.0) == pytest.approx(const.BUCKET_HEAPED_VOLUME_M3, rel=0.005)


def test_struck_volume_follows_from_the_cross_section():
    geometry = bucket_geometry()
    x, z = geometry.profile_t.T
    area_m2 = -np.trapezoid(z, x)  # from the edge at large x to the lip
    assert area_m2 == pytest.approx(0.359, abs=0.001)
    assert geometry.struck_volume_m3 == pytest.approx(area_m2 * geometry.inner_width_m)
    assert geometry.struck_volume_m3 == pytest.approx(0.2584, abs=0.001)


def test_full_scoop_of_sand_weighs_as_much_as_published():
    assert 1474.0 * heaped_volume_m3(bucket_geometry(), slope_tan=1.0) == pytest.approx(485.0, rel=0.05)


def test_edge_and_lip_lie_on_the_opening_line():
    profile = bucket_geometry().profile_t
    np.testing.assert_array_equal(profile[0], [1.15, 0.0])
    np.testing.assert_array_equal(profile[-1], [0.28, 0.0])
    assert (profile[1:-1, 1] > 0).all()


def test_bottom_plate_leaves_the_edge_at_45_degrees():
    edge, end = bucket_geometry().profile_t[:2]
    assert np.degrees(np.arctan2(end[1] - edge[1], edge[0] - end[0])) == pytest.approx(45.0, abs=1.0)
