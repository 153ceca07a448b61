import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import surfaces

from .conftest import skin_mesh


def test_vertices_are_the_surface_and_a_skirt_below_its_border():
    grid = surfaces._grid((0.4, 0.3), 0.1)
    heights = np.arange(20.0).reshape(5, 4) / 10
    vertices = surfaces.skin_vertices(grid, heights)
    np.testing.assert_allclose(vertices[:20].reshape(5, 4, 3)[..., 2], heights, rtol=1e-6)
    np.testing.assert_allclose(vertices[:20].reshape(5, 4, 3)[..., :2], grid, rtol=1e-6)
    skirt = vertices[20:]
    assert len(skirt) == 2 * (5 + 4) - 4
    assert (skirt[:, 2] < 0).all()
    assert len(np.unique(skirt, axis=0)) == len(skirt)


@pytest.mark.parametrize("name", [surfaces.TERRAIN_SKIN, surfaces.BOX_SOIL_SKIN])
def test_skin_is_a_closed_sheet_that_faces_outwards(model, name):
    vertices, faces = skin_mesh(model, name)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    flat = np.isclose(a[:, 2], b[:, 2]) & np.isclose(a[:, 2], c[:, 2])
    assert (normals[flat, 2] > 0).all()
    outward = (a + b + c)[~flat, :2] / 3
    assert ((normals[~flat, :2] * outward).sum(axis=1) > 0).all()
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() == 2
    assert (uses == 1).sum() == (vertices[:, 2] < 0).sum()  # only the foot of the skirt is open
