import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.tasks.scoop.feasibility import LEAST_MASK_PX, RADIUS_RANGE_M, feasible_centers_w
from lerobot_excav.envs.tasks.scoop.scene import cell_centres_w

X_W, Y_W = cell_centres_w()


def plateau(height_m):
    return np.full((X_W.size, Y_W.size), height_m)


def centers_on(heights_m):
    return feasible_centers_w(heights_m, X_W, Y_W)


def has_center_near(centers_w, x, y):
    return bool((np.hypot(*(centers_w[:, :2] - (x, y)).T) < 0.1).any())


def test_regions_lie_within_reach_and_on_the_surface():
    centers_w = centers_on(plateau(0.6))
    radius = np.hypot(*(centers_w[:, :2] - MACHINE_POS_W[:2]).T)
    assert len(centers_w) > 100
    assert RADIUS_RANGE_M[0] <= radius.min() <= radius.max() <= RADIUS_RANGE_M[1]
    assert (centers_w[:, 2] == 0.6).all()


@pytest.mark.parametrize("height_m", [0.0, 0.3])
def test_shallow_soil_offers_no_region(height_m):
    assert centers_on(plateau(height_m)).shape == (0, 3)


def test_a_patch_without_soil_in_front_of_it_is_not_offered():
    heights_m = plateau(0.6)
    heights_m[X_W < -0.5] = 0.0
    assert has_center_near(centers_on(plateau(0.6)), 0.0, 0.0)
    assert not has_center_near(centers_on(heights_m), 0.0, 0.0)


def test_a_region_that_other_soil_hides_from_the_main_view_is_not_offered():
    heights_m = plateau(0.6)
    heights_m[:, (Y_W > -0.6) & (Y_W < -0.4)] = 2.5
    assert has_center_near(centers_on(plateau(0.6)), -0.4, 0.2)
    assert not has_center_near(centers_on(heights_m), -0.4, 0.2)


def test_the_least_mask_decides(monkeypatch):
    few = len(centers_on(plateau(0.6)))
    monkeypatch.setattr("lerobot_excav.envs.tasks.scoop.feasibility.LEAST_MASK_PX", 0.5 * LEAST_MASK_PX)
    assert len(centers_on(plateau(0.6))) > few
