"""One blade of the experiment moving_blade, which has them all."""

import pytest

from validation.soil.moving_blade import DEPTHS_M, FROM_M, MEASURED_N, drag, washed_sand


@pytest.mark.parametrize(("azimuth_deg", "speed_m_s"), [(0.0, 0.25), (33.0, 0.4)])
def test_a_blade_that_is_dragged_through_sand_meets_the_measured_draught(azimuth_deg, speed_m_s):
    """Also off the axes of the grid and at another speed."""
    width, k = 0.3, 2
    found = drag(washed_sand(), width_m=width, depth_m=DEPTHS_M[k], azimuth_deg=azimuth_deg, speed_m_s=speed_m_s)
    mean = found[found[:, 0] >= FROM_M, 1].mean()
    assert mean == pytest.approx(MEASURED_N[width][k], rel=0.3)
    assert mean > 1.1 * found[0, 1]  # the heap that it pushes counts
