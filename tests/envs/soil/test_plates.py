import numpy as np
import pytest

from bench.soil import BUCKET
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces

FACES = OuterFaces.of(BUCKET, 4)
SHELL = ~FACES.is_edge


def test_the_pieces_cover_the_whole_shell():
    length = np.linalg.norm(np.diff(BUCKET.profile_t, axis=0), axis=1).sum()
    assert FACES.areas_m2[SHELL].sum() == pytest.approx(length * BUCKET.inner_width_m)
    assert np.linalg.norm(FACES.ends_t - FACES.starts_t, axis=1).max() <= 0.2
    assert len(FACES.starts_t) % FACES.rows == 0


def test_the_pieces_lie_on_the_inside_of_the_plates_and_look_out():
    for points in (FACES.starts_t, FACES.ends_t):
        reach = points[SHELL] @ BUCKET.planes_t[:, :3].T - BUCKET.planes_t[:, 3]
        np.testing.assert_allclose(reach[:, 1:-2].max(axis=1), 0.0, atol=1e-9)  # on a plate, beyond none
    np.testing.assert_allclose(np.linalg.norm(FACES.normals_t, axis=1), 1.0)
    middles = 0.5 * (FACES.starts_t + FACES.ends_t) + 0.01 * FACES.normals_t
    assert ((middles[SHELL] @ BUCKET.planes_t[:, :3].T - BUCKET.planes_t[:, 3]).max(axis=1) > 0.0).all()


def test_the_pieces_are_spread_over_the_width_without_a_side():
    lateral = np.unique(FACES.starts_t[:, 1].round(9))
    np.testing.assert_allclose(lateral, [-0.27, -0.09, 0.09, 0.27])
    assert np.array_equal(FACES.starts_t[:, 1], FACES.ends_t[:, 1])


def test_the_edge_is_the_blunt_end_of_the_bottom_plate():
    edge = FACES.is_edge
    assert FACES.areas_m2[edge].sum() == pytest.approx(PLATE_THICKNESS_M * BUCKET.inner_width_m)
    assert np.array_equal(FACES.starts_t[edge], FACES.ends_t[edge])
    np.testing.assert_allclose(FACES.starts_t[edge][:, [0, 2]], np.tile(BUCKET.profile_t[0], (4, 1)))
    along = (BUCKET.profile_t[1] - BUCKET.profile_t[0]) / np.linalg.norm(BUCKET.profile_t[1] - BUCKET.profile_t[0])
    np.testing.assert_allclose(FACES.normals_t[edge][:, [0, 2]], np.tile(-along, (4, 1)))
