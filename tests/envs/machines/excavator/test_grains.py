import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.bodywork import HIDDEN_GROUP, LOOSE_SOIL_GROUP
from lerobot_excav.envs.machines.excavator.grains import MOST_PARCELS, PARCELS_PER_SKIN, Grains
from lerobot_excav.envs.soil import FIDELITIES

from .conftest import skin_mesh


def shown_vertices(model):
    skins = [i for i in range(model.nskin) if model.skin(i).name.startswith("grains")]
    starts = [model.skin_vertadr[i] for i in skins if model.skin_group[i] == LOOSE_SOIL_GROUP]
    assert len({model.skin_vertnum[i] for i in skins}) == 1
    return np.concatenate([model.skin_vert[s : s + model.skin_vertnum[skins[0]]] for s in starts] or [[]])


@pytest.mark.parametrize("count", [0, 1, PARCELS_PER_SKIN, PARCELS_PER_SKIN + 1, MOST_PARCELS, MOST_PARCELS + 7])
def test_as_many_skins_are_drawn_as_the_parcels_fill_and_the_rest_is_left_out(model, count):
    Grains(model).show(np.zeros((count, 3)), np.ones(count))
    assert (model.skin_group == LOOSE_SOIL_GROUP).sum() == -(-min(count, MOST_PARCELS) // PARCELS_PER_SKIN)
    assert (model.skin_group == HIDDEN_GROUP).sum() >= 1


def test_grains_lie_around_their_parcels_and_scale_with_them(model, rng):
    positions = rng.uniform(-1.0, 1.0, (PARCELS_PER_SKIN, 3))
    shapes = []
    for radius in (0.04, 0.08):
        Grains(model).show(positions, np.full(len(positions), radius))
        vertices = shown_vertices(model).reshape(len(positions), -1, 3)
        shapes.append((vertices - positions[:, None]) / radius)
    np.testing.assert_allclose(shapes[0], shapes[1], atol=1e-4)
    assert np.linalg.norm(shapes[0], axis=-1).max() < 2.1
    assert np.abs(shapes[0].mean(axis=(0, 1))).max() < 0.1


def test_what_is_left_of_a_skin_is_not_seen(model):
    Grains(model).show(np.array([[1.0, 2.0, 3.0]]), np.array([0.05]))
    vertices = shown_vertices(model).reshape(PARCELS_PER_SKIN, -1, 3)
    assert np.ptp(vertices[0], axis=0).min() > 0.02
    assert not np.ptp(vertices[1:], axis=(0, 1)).any()


def test_the_finest_soil_has_no_more_parcels_than_are_drawn():
    # A full bucket holds a third of a cubic metre besides what is in motion.
    for fidelity in FIDELITIES.values():
        in_bucket = 0.34 * 0.6 / (4.0 / 3.0 * np.pi * fidelity.parcel_radius_m**3)
        assert fidelity.most_awake + in_bucket < MOST_PARCELS


def test_faces_look_outwards(model):
    Grains(model).show(np.zeros((PARCELS_PER_SKIN, 3)), np.ones(PARCELS_PER_SKIN))
    vertices, faces = skin_mesh(model, "grains_0")
    middle = vertices.reshape(-1, 4, 3).mean(axis=1).repeat(4, axis=0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert ((np.cross(b - a, c - a) * (a - middle)).sum(axis=1) > 0.0).all()
