import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry, heaped_volume_m3


def test_heaped_volume_is_that_of_the_datasheet():
    assert heaped_volume_m3(bucket_geometry()) == pytest.approx(const.BUCKET_HEAPED_VOLUME_M3, rel=0.005)


def test_struck_volume_follows_from_the_cross_section():
    geometry = bucket_geometry()
    x, z = geometry.profile_t.T
    area_m2 = -np.trapezoid(z, x)  # from the edge at large x to the lip
    assert area_m2 == pytest.approx(0.359, abs=0.001)
    assert geometry.struck_volume_m3 == pytest.approx(area_m2 * geometry.inner_width_m)
    assert geometry.struck_volume_m3 == pytest.approx(0.2584, abs=0.001)


def test_full_scoop_of_sand_weighs_as_much_as_published():
    assert 1474.0 * heaped_volume_m3(bucket_geometry()) == pytest.approx(485.0, rel=0.05)


def test_heap_equals_its_numerical_integral():
    geometry = bucket_geometry()
    length = np.linalg.norm(geometry.profile_t[0] - geometry.profile_t[-1])
    x = (np.arange(400) + 0.5) / 400 * length
    y = (np.arange(400) + 0.5) / 400 * geometry.inner_width_m
    from_sides = np.minimum.outer(np.minimum(x, length - x), np.minimum(y, geometry.inner_width_m - y))
    heap = from_sides.mean() * length * geometry.inner_width_m
    assert heaped_volume_m3(geometry) - geometry.struck_volume_m3 == pytest.approx(heap, rel=1e-4)


def test_edge_and_lip_lie_on_the_opening_line():
    profile = bucket_geometry().profile_t
    np.testing.assert_array_equal(profile[0], [1.15, 0.0])
    np.testing.assert_array_equal(profile[-1], [0.28, 0.0])
    assert (profile[1:-1, 1] > 0).all()


def test_bottom_plate_leaves_the_edge_at_45_degrees():
    edge, end = bucket_geometry().profile_t[:2]
    assert np.degrees(np.arctan2(end[1] - edge[1], edge[0] - end[0])) == pytest.approx(45.0, abs=1.0)
