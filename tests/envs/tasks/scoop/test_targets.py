import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.tasks.scoop.scene import cell_centres_w
from lerobot_excav.envs.tasks.scoop.targets import Target, TooFewTargetsError, find_targets

coordinate = st.floats(-3.0, 3.0)


@given(coordinate, coordinate, st.floats(-np.pi, np.pi), st.floats(-0.39, 0.39), st.floats(-0.39, 0.39))
def test_patch_contains_exactly_its_own_square(x, y, yaw, along, across):
    target = Target(center_w=np.array([x, y, 0.5]), yaw_rad=yaw)
    forward, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    inside = np.array([x, y]) + along * forward + across * left
    assert target.contains(inside)
    assert not target.contains(inside + 0.82 * forward)
    assert not target.contains(inside - 0.82 * left)


def test_any_height_is_inside_and_a_point_that_is_not_known_outside_of_every_patch():
    points_w = np.full((4, 5, 3), np.nan)
    points_w[1, 2:4] = [[0.2, -0.1, -2.0], [0.2, -0.1, 5.0]]
    points_w[2, 2] = [1.2, -0.1, 0.6]
    inside = Target(center_w=np.zeros(3), yaw_rad=0.0).contains(points_w)
    assert np.argwhere(inside).tolist() == [[1, 2], [1, 3]]


def test_flat_ground_offers_no_target():
    x_w, y_w = cell_centres_w()
    with pytest.raises(TooFewTargetsError, match="no room for 4 dig regions"):
        find_targets(np.zeros((x_w.size, y_w.size)), x_w, y_w, np.random.default_rng(0))
