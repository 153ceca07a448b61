import numpy as np
import pytest

from bench.soil import BUCKET
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M, OuterFaces

FACES = OuterFaces.of(BUCKET, 4)
IS_SIDE = np.abs(FACES.normals_t[:, 1]) == 1.0


def test_the_samples_stand_for_the_whole_shell_and_both_side_plates():
    length = np.linalg.norm(np.diff(BUCKET.profile_t, axis=0), axis=1).sum()
    assert FACES.areas_m2[~IS_SIDE].sum() == pytest.approx(length * BUCKET.inner_width_m)
    assert FACES.breadths_m[~IS_SIDE].sum() == pytest.approx(length)
    assert FACES.areas_m2[IS_SIDE].sum() == pytest.approx(2 * BUCKET.struck_volume_m3 / BUCKET.inner_width_m)
    assert not FACES.breadths_m[IS_SIDE].any()


def test_the_samples_lie_one_plate_outside_of_the_inside():
    inner = FACES.points_t - PLATE_THICKNESS_M * FACES.normals_t
    reach = inner @ BUCKET.planes_t[:, :3].T - BUCKET.planes_t[:, 3]
    np.testing.assert_allclose(reach[:, 1:].max(axis=1), 0.0, atol=1e-9)  # on a plate, beyond none
    np.testing.assert_allclose(np.linalg.norm(FACES.normals_t, axis=1), 1.0)
    assert ((FACES.points_t @ BUCKET.planes_t[1:, :3].T - BUCKET.planes_t[1:, 3]).max(axis=1) > 0.0).all()


def test_the_samples_of_the_shell_are_spread_over_the_width_without_a_side():
    lateral = np.unique(FACES.points_t[~IS_SIDE, 1].round(9))
    np.testing.assert_allclose(lateral, [-0.27, -0.09, 0.09, 0.27])
    assert FACES.areas_m2 @ FACES.points_t[:, 1] == pytest.approx(0.0, abs=1e-9)
