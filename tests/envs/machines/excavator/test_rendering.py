import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import cameras
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.rendering import CAMERAS, WorksiteRenderer
from lerobot_excav.envs.soil import Soil

HEIGHT, WIDTH = 96, 128
AWAY = np.array([-2.8, 0.9, -1.0, -1.5])  # behind itself, out of the picture of the dig area
OVER_PILE = np.array([0.0, 0.5, -1.4, -1.0])
CARRYING = np.array([0.3, 0.5, -1.9, -1.9])
DUMPING = np.array([1.39, 0.85, -1.5, -0.9])


class StillWorksite:
    """A worksite on which nothing has come to rest since the start."""

    def __init__(self, machine, soil):
        self.machine, self.soil = machine, soil

    @property
    def start_heights_m(self):
        return self.soil.heights_m


@pytest.fixture(scope="module")
def shared_soil():
    return Soil(container=TARGET_BOX)


@pytest.fixture
def soil(shared_soil):
    shared_soil.reset(None)
    return shared_soil


@pytest.fixture(scope="module")
def module_renderer(machine):
    renderer = WorksiteRenderer(StillWorksite(machine, None), height=HEIGHT, width=WIDTH)
    yield renderer
    renderer.close()


@pytest.fixture
def renderer(module_renderer, soil):
    """A renderer of flat soil."""
    return seen(module_renderer, soil)


def seen(renderer, soil):
    """Let a renderer look at other soil."""
    renderer._worksite.soil = soil
    return renderer


def pixels_that_differ(a, b):
    return np.any(a != b, axis=-1).sum()


def cone(soil, slope):
    return np.maximum(1.0 - slope * np.hypot(soil.x_w[:, None], soil.y_w[None, :]), 0.0)


def ray_cast(rise_x, rise_y, base):
    """Points where the rays of the main camera meet the plane z = base + rise_x x + rise_y y, and their depths."""
    focal = 0.5 * HEIGHT / np.tan(0.5 * np.radians(cameras.MAIN.fovy_deg))
    row, column = np.indices((HEIGHT, WIDTH)) + 0.5
    rays = np.stack([(column - WIDTH / 2) / focal, (HEIGHT / 2 - row) / focal, -np.ones_like(row)], axis=-1)
    rays = rays @ cameras.MAIN.axes.T
    eye = np.array(cameras.MAIN.position)
    normal = np.array([-rise_x, -rise_y, 1.0])
    depth = (base - eye @ normal) / (rays @ normal)
    return eye + depth[..., None] * rays, depth


@pytest.mark.parametrize("camera", CAMERAS)
def test_picture_is_rgb_of_the_asked_size_and_the_same_for_the_same_state(renderer, camera):
    picture = renderer.render(camera)
    assert (picture.shape, picture.dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    np.testing.assert_array_equal(renderer.render(camera), picture)


def test_main_stands_still_and_cab_turns_with_the_machine(machine, renderer):
    pictures = []
    for swing in (0.0, 2.5):
        machine.reset(np.array([swing, 0.5, -1.4, -1.0]))
        pictures.append((renderer.render("main"), renderer.render("cab")))
    corner = np.s_[-10:, -30:]  # ground far from the machine
    np.testing.assert_array_equal(pictures[0][0][corner], pictures[1][0][corner])
    main, cab = (pixels_that_differ(*views) / (HEIGHT * WIDTH) for views in zip(*pictures, strict=True))
    assert main < 0.5 < cab


# From a scripted operator's cycle: reaching, cutting, curling, lifting, carrying, dumping [rad].
CYCLE = [
    (0.37, 0.68, -1.2, -1.02),
    (0.03, 0.46, -1.52, -0.51),
    (0.03, 0.37, -1.84, -1.49),
    (0.03, 0.59, -1.95, -1.66),
    (0.8, 0.77, -1.64, -2.13),
    (1.4, 0.78, -1.35, -1.28),
]


@pytest.mark.parametrize("pose", CYCLE)
def test_the_boom_covers_little_of_the_cab_view(machine, renderer, pose):
    machine.reset(np.array(pose))
    bodies = machine.model.geom_bodyid[renderer._pictures.geoms("cab", renderer._all)]
    arm = np.isin(bodies, [machine.model.body(name).id for name in ("boom", "arm")])
    assert arm.mean() < 0.13


@pytest.mark.parametrize("plane", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.5), (0.08, -0.05, 0.5)])
def test_terrain_points_equal_analytic_ray_casts_and_are_soil_only(machine, renderer, soil, plane):
    machine.reset(AWAY)
    soil.reset(np.maximum(plane[2] + plane[0] * soil.x_w[:, None] + plane[1] * soil.y_w[None, :], 0.0))
    points_w = renderer.terrain_points_w()
    expected, _ = ray_cast(*plane)
    inside = (np.abs(expected[..., :2]) < 2.85).all(axis=-1)
    assert inside.sum() > 2000
    assert np.isfinite(points_w[inside]).all()
    assert np.abs(points_w[inside] - expected[inside]).max() < 0.03
    if plane == (0.0, 0.0, 0.0):
        assert np.isnan(points_w[(np.abs(expected[..., :2]) > 3.1).any(axis=-1)]).all()


def test_terrain_points_see_through_the_machine(machine, renderer, soil):
    soil.reset(cone(soil, 0.5))
    views = []
    for pose in (AWAY, OVER_PILE):
        machine.reset(pose)
        views.append((renderer.terrain_points_w(), renderer.depth_m("main")))
    np.testing.assert_array_equal(views[0][0], views[1][0])
    boom = views[1][1] < views[0][1] - 0.5
    assert 100 < boom.sum() < 0.3 * boom.size


def test_terrain_points_lie_on_the_soil(renderer, soil):
    soil.reset(cone(soil, 0.6))
    points_w = renderer.terrain_points_w()
    ground_w = points_w[np.isfinite(points_w[..., 0])]
    error = np.abs(ground_w[:, 2] - soil.height_at(ground_w[:, :2]))
    assert np.quantile(error, 0.99) < 0.03
    assert error.max() < 0.08


def test_depth_is_measured_along_the_optical_axis_and_registered_with_main(machine, renderer, soil):
    machine.reset(AWAY)
    soil.reset(np.full(soil.heights_m.shape, 0.4))
    depth = renderer.depth_m("main")
    points_w, expected = ray_cast(0.0, 0.0, 0.4)
    inside = (np.abs(points_w[..., :2] - [0.3, 0.0]) < 2.4).all(axis=-1)  # away from the dozer blade
    assert depth.dtype == np.float32
    assert np.abs(depth[inside] - expected[inside]).max() < 0.02


def test_picture_follows_the_soil_in_place(machine, renderer, soil):
    machine.reset(AWAY)
    flat = renderer.render("main")
    soil.reset(cone(soil, 0.6))
    assert pixels_that_differ(renderer.render("main"), flat) > 300
    soil.reset(None)
    np.testing.assert_array_equal(renderer.render("main"), flat)
    soil.add_parcels(np.random.default_rng(0).uniform([-1, -1, 1.0], [1, 1, 1.5], (200, 3)), np.zeros((200, 3)))
    assert pixels_that_differ(renderer.render("main"), flat) > 50


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("place", ["carried", "poured"])
def test_loose_soil_is_seen_from_every_camera(machine, renderer, soil_with_parcels, rng, camera, place):
    if place == "carried":
        machine.reset(CARRYING)
        x, y, z = np.meshgrid(np.arange(0.4, 1.0, 0.08), np.arange(-0.3, 0.31, 0.08), np.arange(-0.1, 0.35, 0.08))
        heap_t = np.stack([x, y, z], axis=-1)[z < 1.0 - x]
        places_w = heap_t @ machine.tool().rotation_w.T + machine.tool().position_w
    else:
        machine.reset(DUMPING)
        places_w = TARGET_BOX.center_w + rng.uniform([-0.3, -0.3, 1.0], [0.3, 0.3, 2.0], (300, 3))
    without = seen(renderer, soil_with_parcels()).render(camera)
    with_soil = seen(renderer, soil_with_parcels(places_w, is_load=place == "carried")).render(camera)
    assert pixels_that_differ(with_soil, without) >= 10


@pytest.mark.parametrize("camera", ["main", "cab", "side"])
def test_a_heap_in_the_box_is_seen(machine, renderer, soil, rng, camera):
    machine.reset(DUMPING)
    empty = renderer.render(camera)
    positions = TARGET_BOX.center_w + rng.uniform([-0.4, -0.4, 0.1], [0.4, 0.4, 1.2], (500, 3))
    soil.add_parcels(positions, np.zeros_like(positions))
    for _ in range(200):
        soil.step()
    assert soil.box_mass_kg > 400.0
    assert pixels_that_differ(renderer.render(camera), empty) >= 10


def test_the_view_without_machine_shows_no_loose_soil(renderer, soil_with_parcels, rng):
    before = seen(renderer, soil_with_parcels()).terrain_points_w()
    after = seen(renderer, soil_with_parcels(rng.uniform([-1, -1, 0.5], [1, 1, 1.5], (200, 3)))).terrain_points_w()
    np.testing.assert_array_equal(before, after)


def test_appearance_changes_the_picture(machine, renderer):
    before = renderer.render("main")
    machine.set_appearance(Appearance(soil_rgb=(0.5, 0.1, 0.1), light_intensity=0.3))
    after = renderer.render("main")
    machine.set_appearance(Appearance())
    assert after.mean() < before.mean()
    np.testing.assert_array_equal(renderer.render("main"), before)


def test_two_renderers_of_one_machine_do_not_disturb_each_other(machine, renderer, soil):
    before = renderer.render("main")
    large = WorksiteRenderer(StillWorksite(machine, soil), height=120, width=160)
    assert large.render("main").shape == (120, 160, 3)
    large.close()
    np.testing.assert_array_equal(renderer.render("main"), before)
