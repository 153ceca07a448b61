import numpy as np
import pytest

from lerobot_excav.envs.machines.camera_pictures import CameraPictures
from lerobot_excav.envs.machines.excavator.appearance import Appearance
from lerobot_excav.envs.machines.excavator.features import VIEWS
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.machines.excavator.rendering import CAMERAS, WorksiteRenderer
from lerobot_excav.envs.machines.excavator.viewing import WorksiteView
from lerobot_excav.envs.machines.excavator.worksite import Worksite, WorksiteStart
from lerobot_excav.errors import ConfigurationError

HEIGHT, WIDTH = 120, 160
CELLS = (120, 120)
AWAY = np.array([-2.8, 0.9, -1.0, -1.5])  # behind itself
OVER_GROUND = np.array([0.0, 0.9, -1.4, -1.0])
PATCH_W = np.array([(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)])


@pytest.fixture(scope="module")
def site():
    return Worksite(fidelity="fast")


@pytest.fixture(scope="module")
def shared_view(site):
    view = WorksiteView(site, height=HEIGHT, width=WIDTH)
    yield view
    view.close()


@pytest.fixture
def view(site, shared_view):
    """A view of bare ground, the machine away, nothing of it marked."""
    begin(site)
    shared_view._marked = ()
    return shared_view


def begin(site, heights=0.0, pose=AWAY):
    heights_m = np.broadcast_to(np.asarray(heights, float), CELLS).copy()
    site.reset(WorksiteStart(joint_pos=pose, heights_m=heights_m, appearance=Appearance()))


def pile():
    x = np.linspace(-2.975, 2.975, 120)
    return np.maximum(0.9 - 0.5 * np.hypot(x[:, None], x[None, :]), 0.0)


def seen_points_w(view, camera):
    return view._pictures.points_w(camera, view._all)


def test_every_camera_shows_another_picture_of_the_asked_size_and_the_same_again(site, view):
    begin(site, pile())
    pictures = {camera: view.render(camera) for camera in VIEWS}
    assert {picture.shape for picture in pictures.values()} == {(HEIGHT, WIDTH, 3)}
    assert len({picture.tobytes() for picture in pictures.values()}) == len(VIEWS)
    for camera, picture in pictures.items():
        np.testing.assert_array_equal(view.render(camera), picture)
    with pytest.raises(ConfigurationError, match="camera='top'"):
        view.render("top")


@pytest.mark.parametrize("camera", ["overview", "main"])
def test_a_marked_patch_is_tinted_and_nothing_else(site, view, camera):
    begin(site, 0.4)
    plain = view.render(camera)
    view.mark(PATCH_W)
    marked = view.render(camera).astype(int)
    changed = (marked != plain).any(axis=-1)
    assert changed.sum() > 60
    points_w = seen_points_w(view, camera)
    outside = (np.abs(points_w[..., :2]) > 0.4 + 0.4).any(axis=-1)  # more than a pixel, of a low view, away
    assert not changed[outside].any()
    inside = (np.abs(points_w[..., :2]) < 0.3).all(axis=-1)
    assert changed[inside].mean() > 0.95
    assert ((marked - plain)[inside][:, 0] - (marked - plain)[inside][:, 2]).mean() > 20  # redder
    view.mark(PATCH_W + np.array([1.2, 0.0]), shown=PATCH_W)
    shown = view.render(camera).astype(int)
    assert (shown - plain)[inside][:, 2].mean() > (shown - plain)[inside][:, 0].mean() + 20  # bluer


@pytest.mark.parametrize("camera", VIEWS)
def test_a_heap_in_the_box_is_seen_from_every_camera(site, view, rng, camera):
    begin(site, 0.0, np.array([1.39, 0.85, -1.5, -0.9]))
    empty = view.render(camera)
    positions = TARGET_BOX.center_w + rng.uniform([-0.4, -0.4, 0.1], [0.4, 0.4, 1.2], (200, 3))
    site.soil.add_parcels(positions, np.zeros_like(positions))
    for _ in range(150):
        site.soil.step()
    assert site.soil.box_mass_kg > 100.0
    changed = (np.abs(view.render(camera).astype(int) - empty) > 20).any(axis=-1)
    assert changed.sum() > 30


def test_the_dig_area_has_no_border_on_bare_ground(view):
    picture, points_w = view.render("overview").astype(int), seen_points_w(view, "overview")
    near = np.abs(points_w[..., :2]).max(axis=-1)
    is_ground = np.abs(points_w[..., 2]) < 0.02
    rings = [is_ground & (low < near) & (near < low + 0.25) for low in (2.4, 2.7, 3.05, 3.35)]
    assert min(ring.sum() for ring in rings) > 50
    brightness = [picture[ring].mean() for ring in rings]
    assert np.ptp(brightness) < 12


def test_there_is_a_sky_above_a_horizon_into_which_the_ground_fades(view):
    picture = view.render("overview").astype(int)
    sky, ground = picture[2, 80], picture[-30, 80]
    assert sky[2] > sky[0] + 15  # blue
    assert ground[2] < ground[0]
    rows = picture[:30].mean(axis=(1, 2))
    assert np.abs(np.diff(rows)).max() < 60  # no hard edge


def test_machine_and_box_cast_shadows_on_the_ground_and_on_soil(site, view):
    for heights, pose in ((0.0, OVER_GROUND), (0.4, OVER_GROUND)):
        begin(site, heights, AWAY)
        free = view.render("main").astype(int)
        points_w = seen_points_w(view, "main")
        begin(site, heights, pose)
        covered = view.render("main").astype(int)
        still = np.linalg.norm(seen_points_w(view, "main") - points_w, axis=-1) < 0.01
        in_area = (np.abs(points_w[..., :2]) < 2.8).all(axis=-1)
        darker = still & in_area & (covered.sum(axis=-1) < 0.8 * free.sum(axis=-1))
        assert darker.sum() > 60


@pytest.mark.parametrize("place", ["ground", "soil", "box"])
def test_a_plumb_line_hangs_from_the_bucket_to_what_is_below_it(site, view, place):
    pose = np.array([1.39, 0.85, -1.5, -0.9]) if place == "box" else OVER_GROUND
    begin(site, 0.35 if place == "soil" else 0.0, pose)
    edge_w = site.machine.cutting_edge_pos_w
    floor = {"ground": 0.0, "soil": 0.35, "box": TARGET_BOX.center_w[2]}[place]
    assert site.bucket_height_m == pytest.approx(edge_w[2] - floor, abs=0.01)
    assert site.bucket_height_m > 0.5
    view.render("side")
    line, foot = (view._data.geom(name).xpos for name in ("plumb_line", "plumb_foot"))
    assert foot == pytest.approx([*edge_w[:2], floor], abs=0.01)
    assert line == pytest.approx([*edge_w[:2], 0.5 * (edge_w[2] + floor)], abs=0.01)


def test_there_is_no_plumb_line_when_the_bucket_is_in_the_soil(site, view):
    begin(site, 4.0, OVER_GROUND)
    assert site.bucket_height_m < 0.0
    view.render("side")
    assert view._model.geom("plumb_line").rgba[3] == 0.0


def test_edges_are_smooth(site, view):
    begin(site, 0.0, AWAY)
    colours = len(np.unique(view.render("overview").reshape(-1, 3), axis=0))
    hard = WorksiteView(site, height=HEIGHT, width=WIDTH)
    hard._model.vis.quality.offsamples = 0
    assert colours > 1.1 * len(np.unique(hard.render("overview").reshape(-1, 3), axis=0))
    hard.close()


def test_a_scene_keeps_its_colours(site, view):
    begin(site, pile())
    plain = view.render("overview").astype(int)
    site.machine.set_appearance(Appearance(soil_rgb=(0.5, 0.1, 0.1), box_rgb=(0.1, 0.6, 0.1)))
    changed = view.render("overview").astype(int)
    site.machine.set_appearance(Appearance())
    points_w = seen_points_w(view, "overview")
    soil = (np.abs(points_w[..., :2]) < 0.5).all(axis=-1)
    assert (changed - plain)[soil][:, 1].mean() < -30


def test_policies_see_the_same_whether_people_watch_or_not(site, view):
    begin(site, pile(), OVER_GROUND)
    renderer = WorksiteRenderer(site, height=96, width=128)
    before = [renderer.render(camera) for camera in CAMERAS]
    view.mark(PATCH_W)
    for camera in VIEWS:
        view.render(camera)
    for camera, picture in zip(CAMERAS, before, strict=True):
        np.testing.assert_array_equal(renderer.render(camera), picture)
    renderer.close()
    assert isinstance(view._pictures, CameraPictures)
    assert "plumb_line" not in [site.machine.model.geom(i).name for i in range(site.machine.model.ngeom)]
