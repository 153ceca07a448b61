import numpy as np
import pytest

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.bodywork import LOOSE_SOIL_GROUP
from lerobot_excav.envs.machines.excavator.interpolation import resampled, smooth
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.soil_picture import SoilPicture
from lerobot_excav.envs.soil import Soil

from .conftest import PARCEL_RADIUS_M as RADIUS_M
from .conftest import skin_mesh

LEVEL = np.zeros((120, 120))


@pytest.fixture
def picture(machine):
    return SoilPicture(machine.model, machine)


def skin(machine, name):
    return skin_mesh(machine.model, name)[0]


def drawn(machine, name):
    return machine.model.skin_group[machine.model.skin(name).id] == LOOSE_SOIL_GROUP


def in_bucket(machine, places_t):
    tool = machine.tool()
    return np.asarray(places_t) @ tool.rotation_w.T + tool.position_w


@pytest.mark.parametrize("slope", [0.4, 0.0], ids=["a cone", "level to the border"])
def test_terrain_skin_takes_the_heights_of_the_soil(machine, picture, slope):
    soil = Soil()
    soil.reset(np.maximum(0.8 - slope * np.hypot(soil.x_w[:, None], soil.y_w[None, :]), 0.0))
    picture.update(soil, soil.heights_m)
    vertices = skin(machine, "terrain")
    surface = vertices[vertices[:, 2] >= 0]
    assert len(surface) == 61 * 61
    np.testing.assert_allclose(surface[:, 2], soil.height_at(0.999999 * surface[:, :2]), atol=1e-3)


def test_box_skin_shows_soil_where_there_is_some(machine, picture):
    soil = Soil(container=TARGET_BOX)
    picture.update(soil, soil.heights_m)
    assert (skin(machine, "box_soil")[:, 2] < 0).all()
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 6), np.linspace(-0.3, 0.3, 6))
    positions = np.stack([x, y, np.full_like(x, 0.6)], axis=-1).reshape(-1, 3) + TARGET_BOX.center_w
    soil.add_parcels(positions, np.zeros_like(positions))
    for _ in range(150):
        soil.step()
    assert soil.ledger_kg()["box"] > 0
    picture.update(soil, soil.heights_m)
    heights = skin(machine, "box_soil")[:, 2]
    assert 0.0 < heights.max() <= soil.container_heights_m.max() + 1e-6


def test_resampling_keeps_a_plane():
    heights = 0.3 * (np.arange(8)[:, None] + 0.5) / 8 + 0.2 * (np.arange(6)[None, :] + 0.5) / 6
    x, y = np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 4)
    inner = resampled(heights, (5, 4))[1:-1, 1:-1]
    np.testing.assert_allclose(inner, (0.3 * x[:, None] + 0.2 * y)[1:-1, 1:-1], atol=1e-12)


def test_smoothing_keeps_the_volume_of_a_lump_and_spreads_it():
    lump = np.zeros((7, 7))
    lump[3, 3] = 0.16
    assert smooth(lump).sum() == pytest.approx(0.16)
    assert smooth(lump).max() == pytest.approx(0.04)


def test_the_edge_of_thin_soil_in_the_box_moves_steadily_with_the_soil(machine, picture, monkeypatch):
    """No part of the sheet jumps when soil grows from nothing: it comes up through the floor."""
    soil, seen = Soil(container=TARGET_BOX), []
    cells = soil.container_heights_m.shape
    for thickness in np.linspace(0.0, 0.02, 9):
        monkeypatch.setattr(Soil, "container_heights_m", property(lambda _, t=thickness: np.full(cells, t)))
        picture.update(soil, LEVEL)
        seen.append(skin(machine, "box_soil")[: 45 * 45, 2].copy())
    np.testing.assert_allclose(np.diff(seen, axis=0), 0.0025, atol=1e-6)


def test_a_parcel_in_the_air_is_drawn_in_its_place(machine, picture, soil_with_parcels):
    picture.update(soil_with_parcels([(0.5, 0.2, 1.2)]), LEVEL)
    assert drawn(machine, "grains_0")
    assert not drawn(machine, "load")
    assert np.linalg.norm(skin(machine, "grains_0") - [0.5, 0.2, 1.2], axis=1).max() < 2.5 * RADIUS_M


def test_a_load_is_a_skin_that_hides_the_parcels_below_it(machine, picture, soil_with_parcels):
    x, y, z = np.meshgrid(np.arange(0.4, 0.9, 0.08), np.arange(-0.3, 0.31, 0.08), [0.1, 0.2, 0.3])
    places_t = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    picture.update(soil_with_parcels(in_bucket(machine, places_t), is_load=True), LEVEL)
    assert drawn(machine, "load")
    depths = (skin(machine, "grains_0").reshape(-1, 3) - machine.tool().position_w) @ machine.tool().rotation_w
    assert depths[:, 2].max() < 0.2


def test_a_moving_load_is_drawn_in_the_bucket_and_not_a_tick_behind(machine, picture, soil_with_parcels):
    velocity = np.array([3.0, -2.0, 0.0])
    places_w = in_bucket(machine, [(0.7, 0.0, 0.2)])
    soil = soil_with_parcels(places_w - TICK_S * velocity, is_load=True, velocity=velocity)
    picture.update(soil, soil.heights_m)
    moved = skin(machine, "load").copy()
    picture.update(soil_with_parcels(places_w, is_load=True), LEVEL)
    np.testing.assert_allclose(moved, skin(machine, "load"), atol=1e-6)


def test_soil_that_leaves_the_bucket_leaves_the_skin(machine, picture, soil_with_parcels):
    places_w = in_bucket(machine, [(0.7, 0.0, 0.2)])
    picture.update(soil_with_parcels(places_w, is_load=True), LEVEL)
    picture.update(soil_with_parcels(places_w), LEVEL)
    assert not drawn(machine, "load")
    assert drawn(machine, "grains_0")
    picture.update(soil_with_parcels(), LEVEL)
    assert not drawn(machine, "load")
    assert not drawn(machine, "grains_0")
