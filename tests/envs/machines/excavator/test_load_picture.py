import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.bodywork import HIDDEN_GROUP, LOOSE_SOIL_GROUP
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.machines.excavator.load_picture import LOAD_SKIN, LoadPicture, load_grid

from .conftest import PARCEL_RADIUS_M as RADIUS_M
from .conftest import skin_mesh


def surface(model):
    """The z_t of the skin at the vertices of its grid."""
    shape = load_grid().shape[:2]
    return skin_mesh(model, LOAD_SKIN)[0][: shape[0] * shape[1], 2].reshape(shape)


def layer(z_t):
    """Parcels side by side at one depth, from cheek to cheek."""
    x, y = np.meshgrid(np.arange(0.35, 1.0, 0.08), np.arange(-0.32, 0.33, 0.08))
    places = np.stack([x, y, np.full_like(x, z_t)], axis=-1).reshape(-1, 3)
    return places, np.full(len(places), RADIUS_M)


@pytest.mark.parametrize("z_t", [0.2, 0.0, -0.15])
def test_the_skin_lies_on_the_parcels(model, z_t):
    LoadPicture(model).show(*layer(z_t))
    grid = load_grid()
    middle = (np.abs(grid[..., 1]) < 0.25) & (grid[..., 0] > 0.45) & (grid[..., 0] < 0.85)
    depth = surface(model)[middle]
    assert z_t - RADIUS_M < depth.min() <= depth.max() < z_t + 0.5 * RADIUS_M


def test_no_skin_without_a_load(model):
    picture = LoadPicture(model)
    skin = model.skin(LOAD_SKIN).id
    assert len(picture.show(*layer(0.1))) > 0
    assert model.skin_group[skin] == LOOSE_SOIL_GROUP
    picture.show(np.zeros((0, 3)), np.zeros(0))
    assert model.skin_group[skin] == HIDDEN_GROUP


def test_the_skin_never_leaves_through_the_shell(model):
    LoadPicture(model).show(np.array([(0.6, 0.0, 0.9), (0.5, 0.1, 0.48)]), np.full(2, RADIUS_M))
    geometry = bucket_geometry()
    places = np.concatenate([load_grid(), surface(model)[..., None]], axis=-1).reshape(-1, 3)
    bottom = geometry.planes_t[1:-2]  # all plates but the cheeks
    assert (places @ bottom[:, :3].T - bottom[:, 3]).max() <= 0.02 + 1e-6


def test_a_parcel_that_stands_out_is_seen_and_those_below_the_skin_are_not(model):
    places = np.concatenate([[(0.6, 0.0, -0.1)], layer(0.05)[0], layer(0.25)[0]])
    seen = LoadPicture(model).show(places, np.full(len(places), RADIUS_M))
    assert seen[0]
    assert not seen[places[:, 2] == 0.25].any()


def test_the_skin_faces_out_of_the_opening(model):
    LoadPicture(model).show(*layer(0.1))
    vertices, faces = skin_mesh(model, LOAD_SKIN)
    sheet = faces[: 2 * np.prod(np.subtract(load_grid().shape[:2], 1))]
    a, b, c = (vertices[sheet[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0.0).all()
