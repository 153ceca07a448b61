import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.excavator.appearance import Appearance
from lerobot_excav.envs.excavator.layout import TARGET_BOX
from lerobot_excav.envs.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.soil import Soil


class LoadedSoil:
    """A soil of which only the moving parts are asked for."""

    parcel_radius_m = 0.05

    def __init__(self, surface_t=(), parcels=()):
        self.payload_surface_t = np.array(surface_t, dtype=float).reshape(-1, 2)
        self.parcel_positions_w = np.array(parcels, dtype=float).reshape(-1, 3)


@pytest.fixture
def machine():
    return ExcavatorMachine(container=TARGET_BOX)


@pytest.fixture
def picture(machine):
    return SoilPicture(machine)


def skin(machine, name):
    index = machine.model.skin(name).id
    start = machine.model.skin_vertadr[index]
    return machine.model.skin_vert[start : start + machine.model.skin_vertnum[index]]


def drawn(machine, picture, soil, maxgeom=100):
    scene = mujoco.MjvScene(machine.model, maxgeom=maxgeom)
    picture.add_moving_soil(scene, soil)
    return scene.geoms[: scene.ngeom]


def test_terrain_skin_takes_the_heights_of_the_soil(machine, picture):
    soil = Soil()
    soil.reset(np.maximum(0.8 - 0.4 * np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij")), 0.0))
    picture.update_skins(soil)
    vertices = skin(machine, "terrain")
    surface = vertices[vertices[:, 2] >= 0]
    assert len(surface) == 61 * 61
    np.testing.assert_allclose(surface[:, 2], soil.height_at(0.999999 * surface[:, :2]), atol=1e-3)


def test_soil_at_the_border_keeps_its_height(machine, picture):
    soil = Soil()
    soil.reset(np.full(soil.heights_m.shape, 0.3))
    picture.update_skins(soil)
    vertices = skin(machine, "terrain")
    np.testing.assert_allclose(vertices[vertices[:, 2] >= 0, 2], 0.3, rtol=1e-6)


def test_box_skin_shows_soil_where_there_is_some(machine, picture):
    soil = Soil(container=TARGET_BOX)
    picture.update_skins(soil)
    assert (skin(machine, "box_soil")[:, 2] < 0).all()
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 6), np.linspace(-0.3, 0.3, 6))
    positions = np.stack([x, y, np.full_like(x, 0.6)], axis=-1).reshape(-1, 3) + TARGET_BOX.center_w
    soil.add_parcels(positions, np.zeros_like(positions))
    for _ in range(100):
        soil.step()
    assert soil.ledger_kg()["box"] > 0
    picture.update_skins(soil)
    heights = skin(machine, "box_soil")[:, 2]
    assert 0.0 < heights.max() <= soil.container_heights_m.max() + 1e-6


def test_empty_bucket_and_still_air_draw_nothing(machine, picture):
    assert len(drawn(machine, picture, LoadedSoil())) == 0


def test_load_is_drawn_between_the_cheeks_just_below_its_surface(machine, picture):
    tool = machine.tool()
    (slab,) = drawn(machine, picture, LoadedSoil([(1.0, 0.1), (0.7, 0.1), (0.4, 0.1)]))
    local = (slab.pos - tool.position_w) @ tool.rotation_w
    np.testing.assert_allclose(local[:2], [0.7, 0.0], atol=1e-6)
    assert 0.1 < local[2] < 0.13
    np.testing.assert_allclose(slab.size[:2], [0.3, 0.36], atol=1e-6)


def test_heap_reaches_down_to_the_opening(machine, picture):
    flat = drawn(machine, picture, LoadedSoil([(1.0, 0.0), (0.4, 0.0)]))[0]
    heap = drawn(machine, picture, LoadedSoil([(1.0, -0.2), (0.4, -0.2)]))[0]
    assert 2 * (heap.size[2] - flat.size[2]) == pytest.approx(0.2, abs=1e-6)


def test_bent_surface_gets_one_slab_per_straight_piece(machine, picture):
    x = np.linspace(1.1, 0.3, 81)
    ridge = np.stack([x, -0.3 + np.abs(x - 0.7)], axis=1)
    assert len(drawn(machine, picture, LoadedSoil(ridge))) == 2


def test_moving_soil_has_the_colour_and_the_grain_of_the_terrain(machine, picture):
    machine.set_appearance(Appearance(soil_rgb=(0.4, 0.3, 0.2)))
    pieces = drawn(machine, picture, LoadedSoil([(1.0, 0.1), (0.4, 0.1)], [(0.0, 0.0, 1.0)]))
    assert [p.matid for p in pieces] == [machine.model.material("soil").id] * 2
    np.testing.assert_allclose([p.rgba[:3] for p in pieces], [[0.4, 0.3, 0.2]] * 2, atol=1e-6)


def test_every_parcel_is_a_sphere_in_its_place(machine, picture):
    positions = [(0.0, 0.0, 1.0), (0.5, 0.2, 1.2)]
    spheres = drawn(machine, picture, LoadedSoil(parcels=positions))
    np.testing.assert_allclose([s.pos for s in spheres], positions, atol=1e-6)
    assert {s.type for s in spheres} == {int(mujoco.mjtGeom.mjGEOM_SPHERE)}
    assert spheres[0].size[0] == pytest.approx(0.05)


def test_more_parcels_than_the_scene_holds_are_left_out(machine, picture):
    assert len(drawn(machine, picture, LoadedSoil(parcels=np.zeros((50, 3))), maxgeom=20)) == 20
