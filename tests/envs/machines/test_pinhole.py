import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.machines.pinhole import CameraPose, PinholeCamera

EYE, LOOKED_AT = (2.0, -3.0, 4.0), (0.5, 1.0, 0.3)


def camera(height=96, width=128):
    axes = CameraPose(EYE, LOOKED_AT, 45.0).axes
    return PinholeCamera(position_w=np.array(EYE), axes_w=axes, fovy_rad=np.deg2rad(45.0), height=height, width=width)


@given(st.integers(0, 95), st.integers(0, 127), st.floats(0.1, 50.0))
def test_the_point_behind_a_pixel_is_seen_at_that_pixel(row, column, depth_m):
    points_w = camera().points_w(np.full((96, 128), depth_m))
    assert camera().pixel(points_w[row, column]) == pytest.approx((row, column), abs=1e-6)


def test_what_is_looked_at_is_in_the_middle_what_is_higher_above_and_what_is_behind_nowhere():
    assert camera().pixel(np.array(LOOKED_AT)) == pytest.approx((47.5, 63.5))
    row, column = camera().pixel(np.array(LOOKED_AT) + np.array([0.0, 0.0, 0.5]))
    assert row < 47.0
    assert column == pytest.approx(63.5)
    assert camera().pixel(2.0 * np.array(EYE) - LOOKED_AT) is None
