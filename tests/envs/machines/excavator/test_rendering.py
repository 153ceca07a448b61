from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import cameras
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.machines.excavator.rendering import CAMERAS, WorksiteRenderer
from lerobot_excav.envs.soil import Soil
from lerobot_excav.errors import ConfigurationError, RenderingError

HEIGHT, WIDTH = 96, 128
AWAY = np.array([-2.8, 0.9, -1.0, -1.5])  # behind itself, out of the picture of the dig area
OVER_PILE = np.array([0.0, 0.5, -1.4, -1.0])
CARRYING = np.array([0.3, 0.5, -1.9, -1.9])
DUMPING = np.array([1.39, 0.85, -1.5, -0.9])


@pytest.fixture(scope="module")
def machine():
    return ExcavatorMachine(container=TARGET_BOX)


@pytest.fixture(scope="module")
def renderer(machine):
    renderer = WorksiteRenderer(SimpleNamespace(machine=machine, soil=None), height=HEIGHT, width=WIDTH)
    yield renderer
    renderer.close()


@pytest.fixture(scope="module")
def soil():
    return Soil(container=TARGET_BOX)


def seen(renderer, soil):
    """Let a renderer look at other soil."""
    renderer._worksite.soil = soil
    return renderer


def tilted(soil, rise_x, rise_y, base):
    return base + rise_x * soil.x_w[:, None] + rise_y * soil.y_w[None, :]


def ray_cast(rise_x, rise_y, base):
    """Points where the rays of the main camera meet the plane z = base + rise_x x + rise_y y."""
    focal = 0.5 * HEIGHT / np.tan(0.5 * np.radians(cameras.MAIN.fovy_deg))
    row, column = np.indices((HEIGHT, WIDTH)) + 0.5
    rays = np.stack([(column - WIDTH / 2) / focal, (HEIGHT / 2 - row) / focal, -np.ones_like(row)], axis=-1)
    rays = rays @ cameras.MAIN.axes.T
    eye = np.array(cameras.MAIN.position)
    normal = np.array([-rise_x, -rise_y, 1.0])
    depth = (base - eye @ normal) / (rays @ normal)
    return eye + depth[..., None] * rays, depth


@pytest.mark.parametrize("camera", CAMERAS)
def test_picture_is_rgb_of_the_asked_size(renderer, soil, camera):
    picture = seen(renderer, soil).render(camera)
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


def test_same_state_gives_the_same_picture(machine, renderer, soil):
    machine.reset(OVER_PILE)
    np.testing.assert_array_equal(seen(renderer, soil).render("main"), seen(renderer, soil).render("main"))


def test_pictures_are_copies(renderer, soil):
    first = seen(renderer, soil).render("main")
    kept = first.copy()
    seen(renderer, soil).render("cab")
    np.testing.assert_array_equal(first, kept)


def test_main_stands_still_and_cab_turns_with_the_machine(machine, renderer, soil):
    pictures = {}
    for swing in (0.0, 2.5):
        machine.reset(np.array([swing, 0.5, -1.4, -1.0]))
        pictures[swing] = seen(renderer, soil).render("main"), seen(renderer, soil).render("cab")
    corner = np.s_[-10:, -30:]  # ground far from the machine
    np.testing.assert_array_equal(pictures[0.0][0][corner], pictures[2.5][0][corner])
    changed = [np.mean(np.any(pictures[0.0][k] != pictures[2.5][k], axis=-1)) for k in (0, 1)]
    assert changed[0] < 0.5
    assert changed[1] > 0.5


@pytest.mark.parametrize("plane", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.5), (0.08, -0.05, 0.5)])
def test_terrain_points_equal_analytic_ray_casts(machine, renderer, soil, plane):
    machine.reset(AWAY)
    soil.reset(np.maximum(tilted(soil, *plane), 0.0))
    points_w = seen(renderer, soil).terrain_points_w()
    expected, _ = ray_cast(*plane)
    inside = (np.abs(expected[..., :2]) < 2.85).all(axis=-1)
    assert inside.sum() > 2000
    assert np.isfinite(points_w[inside]).all()
    assert np.abs(points_w[inside] - expected[inside]).max() < 0.03


def test_terrain_points_are_soil_only(machine, renderer, soil):
    machine.reset(AWAY)
    soil.reset(None)
    points_w = seen(renderer, soil).terrain_points_w()
    expected, _ = ray_cast(0.0, 0.0, 0.0)
    outside = (np.abs(expected[..., :2]) > 3.1).any(axis=-1)
    assert np.isnan(points_w[outside]).all()


def test_terrain_points_see_through_the_machine(machine, renderer, soil):
    soil.reset(np.maximum(1.0 - 0.5 * np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij")), 0.0))
    views = []
    for pose in (AWAY, OVER_PILE):
        machine.reset(pose)
        views.append((seen(renderer, soil).terrain_points_w(), seen(renderer, soil).depth_m("main")))
    np.testing.assert_array_equal(views[0][0], views[1][0])
    assert (views[0][1] != views[1][1]).any()


def test_terrain_points_lie_on_the_soil(machine, renderer, soil):
    soil.reset(np.maximum(1.0 - 0.6 * np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij")), 0.0))
    points_w = seen(renderer, soil).terrain_points_w()
    ground_w = points_w[np.isfinite(points_w[..., 0])]
    error = np.abs(ground_w[:, 2] - soil.height_at(ground_w[:, :2]))
    assert np.quantile(error, 0.99) < 0.03
    assert error.max() < 0.08


def test_depth_is_measured_along_the_optical_axis_and_registered_with_main(machine, renderer, soil):
    machine.reset(AWAY)
    soil.reset(np.full(soil.heights_m.shape, 0.4))
    depth = seen(renderer, soil).depth_m("main")
    points_w, expected = ray_cast(0.0, 0.0, 0.4)
    inside = (np.abs(points_w[..., :2] - [0.3, 0.0]) < 2.4).all(axis=-1)  # away from the dozer blade
    assert depth.dtype == np.float32
    assert np.abs(depth[inside] - expected[inside]).max() < 0.02


def test_machine_is_nearer_than_the_soil_behind_it(machine, renderer, soil):
    soil.reset(None)
    depths = []
    for pose in (AWAY, OVER_PILE):
        machine.reset(pose)
        depths.append(seen(renderer, soil).depth_m("main"))
    boom = depths[1] < depths[0] - 0.5
    assert 100 < boom.sum() < 0.3 * boom.size


def test_picture_follows_the_soil_in_place(machine, renderer, soil):
    machine.reset(AWAY)
    soil.reset(None)
    flat = seen(renderer, soil).render("main")
    soil.reset(np.maximum(0.8 - 0.6 * np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij")), 0.0))
    assert np.any(seen(renderer, soil).render("main") != flat, axis=-1).sum() > 300
    soil.reset(None)
    np.testing.assert_array_equal(seen(renderer, soil).render("main"), flat)


def test_flying_parcels_are_drawn(machine, renderer, soil):
    machine.reset(AWAY)
    soil.reset(None)
    before = seen(renderer, soil).render("main")
    soil.add_parcels(np.random.default_rng(0).uniform([-1, -1, 1.0], [1, 1, 1.5], (200, 3)), np.zeros((200, 3)))
    assert np.any(seen(renderer, soil).render("main") != before, axis=-1).sum() > 50
    soil.reset(None)


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_load_is_seen_from_every_camera(machine, renderer, soil_with_parcels, heaped_load, camera):
    machine.reset(CARRYING)
    tool = machine.tool()
    places_w = heaped_load @ tool.rotation_w.T + tool.position_w
    empty = seen(renderer, soil_with_parcels()).render(camera)
    loaded = seen(renderer, soil_with_parcels(places_w, is_load=[True] * len(places_w))).render(camera)
    assert np.any(loaded != empty, axis=-1).sum() >= 10


@pytest.mark.parametrize("camera", CAMERAS)
def test_soil_that_pours_into_the_box_is_seen_from_every_camera(machine, renderer, soil_with_parcels, rng, camera):
    machine.reset(DUMPING)
    positions = TARGET_BOX.center_w + rng.uniform([-0.3, -0.3, 1.0], [0.3, 0.3, 2.0], (300, 3))
    empty = seen(renderer, soil_with_parcels()).render(camera)
    pouring = seen(renderer, soil_with_parcels(positions, is_load=[False] * len(positions))).render(camera)
    assert np.any(pouring != empty, axis=-1).sum() >= 10


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_heap_in_the_box_is_seen_from_every_camera(machine, renderer, soil, rng, camera):
    machine.reset(DUMPING)
    soil.reset(None)
    empty = seen(renderer, soil).render(camera)
    positions = TARGET_BOX.center_w + rng.uniform([-0.4, -0.4, 0.1], [0.4, 0.4, 1.2], (500, 3))
    soil.add_parcels(positions, np.zeros_like(positions))
    for _ in range(200):
        soil.step()
    assert soil.box_mass_kg > 400.0
    assert np.any(seen(renderer, soil).render(camera) != empty, axis=-1).sum() >= 10
    soil.reset(None)


def test_the_view_without_machine_shows_no_loose_soil(machine, renderer, soil_with_parcels, rng):
    before = seen(renderer, soil_with_parcels()).terrain_points_w()
    positions = rng.uniform([-1, -1, 0.5], [1, 1, 1.5], (200, 3))
    after = seen(renderer, soil_with_parcels(positions, is_load=[False] * len(positions))).terrain_points_w()
    np.testing.assert_array_equal(before, after)


def test_appearance_changes_the_picture(machine, renderer, soil):
    before = seen(renderer, soil).render("main")
    machine.set_appearance(Appearance(soil_rgb=(0.5, 0.1, 0.1), light_intensity=0.3))
    after = seen(renderer, soil).render("main")
    machine.set_appearance(Appearance())
    assert after.mean() < before.mean()
    np.testing.assert_array_equal(seen(renderer, soil).render("main"), before)


def test_two_renderers_of_one_machine_do_not_disturb_each_other(machine, renderer, soil):
    machine.reset(OVER_PILE)
    before = seen(renderer, soil).render("main")
    large = WorksiteRenderer(SimpleNamespace(machine=machine, soil=None), height=120, width=160)
    assert seen(large, soil).render("main").shape == (120, 160, 3)
    large.close()
    np.testing.assert_array_equal(seen(renderer, soil).render("main"), before)


def test_context_is_made_with_the_first_picture_and_freed_by_close(machine, soil):
    renderer = WorksiteRenderer(SimpleNamespace(machine=machine, soil=None), height=32, width=32)
    assert not renderer._pictures.is_open
    seen(renderer, soil).render("main")
    assert renderer._pictures.is_open
    renderer.close()
    renderer.close()
    with pytest.raises(RenderingError, match="closed"):
        seen(renderer, soil).render("main")


def test_unknown_camera_is_refused(renderer, soil):
    with pytest.raises(ConfigurationError, match="main"):
        seen(renderer, soil).render("top")
