import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.soil.height_field import HeightField


def field():
    return HeightField((8, 6), (0.1, 0.05), 0.0)


@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.2, 0.2), volume=st.floats(1e-6, 1.0))
@settings(max_examples=50)
def test_a_deposit_keeps_its_volume_wherever_it_falls(x, y, volume):
    soil = field()
    soil.deposit(np.array([[x, y]]), np.array([volume]))
    assert soil.volume_m3 == pytest.approx(volume, rel=1e-12)
    assert (soil.heights >= 0).all()


def test_a_deposit_is_centred_where_it_falls():
    soil = field()
    soil.deposit(np.array([[0.03, -0.01]]), np.array([0.01]))
    x, y = soil.centres(0), soil.centres(1)
    assert (soil.heights.sum(axis=1) @ x) / soil.heights.sum() == pytest.approx(0.03)
    assert (soil.heights.sum(axis=0) @ y) / soil.heights.sum() == pytest.approx(-0.01)


def test_a_sample_is_exact_on_a_plane_and_at_cell_centres():
    soil = field()
    soil.reset(1.0 + 0.3 * soil.centres(0)[:, None] - 0.7 * soil.centres(1)[None, :])
    points = np.array([[0.013, 0.021], [-0.3, 0.1], [soil.centres(0)[2], soil.centres(1)[3]]])
    np.testing.assert_allclose(soil.sample(points), 1.0 + 0.3 * points[:, 0] - 0.7 * points[:, 1])


def test_a_window_holds_exactly_the_columns_under_the_points():
    i0, i1, j0, j1 = field().window(np.array([[-0.16, -0.06], [0.16, 0.30]]))
    x, y = field().centres(0), field().centres(1)
    np.testing.assert_allclose(x[i0:i1], [-0.15, -0.05, 0.05, 0.15], atol=1e-12)
    assert y[j0:j1].min() >= -0.06
    assert j1 == 6
