"""Masks of a camera that measures depth: what a real machine has in place of a simulator's knowledge."""

import json
import sys
from contextlib import ExitStack, closing
from dataclasses import dataclass
from types import SimpleNamespace

import draccus
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lerobot.cameras import CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs

import lerobot_excav.plugin  # noqa: F401 - registers the types
from lerobot_excav.cameras.mask_camera.calibration import Calibration, calibration_text, read_calibration
from lerobot_excav.cameras.mask_camera.registered_depth import registered_depth_m
from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.segment_anything import SegmentAnything
from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.envs.masks.vision_language import Answer, VisionLanguageModel
from lerobot_excav.envs.tasks.clear.env import ClearEnv
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.errors import ConfigurationError, DeviceError

from .test_mask_camera import PaintedCamera

HEIGHT, WIDTH = 192, 256
SIZE = f"width: {WIDTH}, height: {HEIGHT}"
LOOKS = {"observation_height": HEIGHT, "observation_width": WIDTH, "render_mode": None}
PLANNED = "source: geometry, targets: regions"
EVERYWHERE = "-20,-20,20,20"


@CameraConfig.register_subclass("measured")
@dataclass(kw_only=True)
class MeasuredCameraConfig(CameraConfig):
    """A camera that shows what a test has put down, with its depth."""

    use_depth: bool = True


class MeasuredCamera(PaintedCamera):
    picture = depth_mm = None

    def __init__(self, config):
        super().__init__(config)
        self.use_depth = config.use_depth

    def read_latest_depth(self, max_age_ms=500):
        return self.depth_mm[..., None].copy()


# Where LeRobot looks for the class that belongs to a configuration.
MeasuredCameraConfig.__module__ = "measured_camera.config_measured_camera"
sys.modules["measured_camera"] = SimpleNamespace(MeasuredCamera=MeasuredCamera)


@dataclass
class AnyRobotConfig:
    cameras: dict[str, CameraConfig]


@pytest.fixture
def mask_of(monkeypatch, tmp_path):
    """Return the mask of a camera that stands where that of a scene stands, and sees what that sees."""

    def _mask(env, mask, *, depth_mm=None, use_depth="true", look=None, unit_m=1e-3):
        monkeypatch.setattr(MeasuredCamera, "picture", env.picture())
        monkeypatch.setattr(MeasuredCamera, "depth_mm", measured_mm(env) if depth_mm is None else depth_mm)
        path = tmp_path / "calibration.toml"
        path.write_text(f"{calibration_text(env.camera)}depth_unit_m = {unit_m}\n")
        top = f"{{type: shared, name: top, camera: {{type: measured, fps: 30, use_depth: {use_depth}, {SIZE}}}}}"
        told = f"{{type: mask, of: top, calibration: {path}, {SIZE}, {mask}}}"
        flag = f"--cameras={{top: {top}, target_mask: {told}}}"
        cameras = make_cameras_from_configs(draccus.parse(AnyRobotConfig, args=[flag]).cameras)
        with ExitStack() as stack:
            for camera in cameras.values():
                camera.connect()
                stack.callback(camera.disconnect)

            def read():
                return cameras["target_mask"].read()[..., 0] > 0

            return read() if look is None else look(read)

    return _mask


@pytest.fixture(scope="module")
def pile():
    with closing(ClearEnv(mask_source="geometry", fidelity="fast", scene_set="val", **LOOKS)) as env:
        env.reset(options={"scene_id": 3})
        yield env


@pytest.fixture(scope="module")
def blocks():
    with closing(FR5GraspEnv(scene_set="val", **LOOKS)) as env:
        env.reset(options={"scene_id": 2, "target_id": 1})
        yield env


def overlap(one, other):
    return (one & other).sum() / (one | other).sum()


def true_region(env, place_w):
    """What the simulator knows of a region, whatever stands before it."""
    return Target(center_w=place_w, yaw_rad=cylinder_from_world(place_w)[1]).contains(env.places_w())


def test_the_planner_points_at_the_region_that_it_chooses_in_the_simulator(pile, mask_of):
    mask = mask_of(pile, PLANNED)
    assert overlap(mask, true_region(pile, pile.plan.proposals[0].target.center_w)) > 0.8


def measured_mm(env):
    return np.rint(1e3 * env.depth_m()).clip(max=65535).astype(np.uint16)


def click_at(path, env, place_w):
    """Write a file of a click on a place; return what names it."""
    row, column = env.camera.pixel(place_w)
    click = [float(column + 0.5) / WIDTH, float(row + 0.5) / HEIGHT]
    path.write_text(f'[[mask]]\nkey = "live"\nclick = {click}\n')
    return f"source: manual, options: {path}"


def test_single_pixels_that_were_not_measured_leave_no_holes(pile, mask_of, tmp_path):
    depth_mm = measured_mm(pile)
    depth_mm[np.random.default_rng(0).random(depth_mm.shape) < 0.3] = 0
    clicked = click_at(tmp_path / "live.toml", pile, pile.plan.proposals[0].target.center_w) + ", targets: regions"
    assert overlap(mask_of(pile, clicked, depth_mm=depth_mm), mask_of(pile, clicked)) > 0.85


def test_a_depth_camera_that_errs_by_two_centimetres_still_shows_the_region(pile, mask_of):
    errors_mm = np.random.default_rng(0).normal(0.0, 20.0, (HEIGHT, WIDTH))
    depth_mm = np.rint(measured_mm(pile) + errors_mm).clip(1, 65535).astype(np.uint16)
    mask = mask_of(pile, PLANNED, depth_mm=depth_mm)
    assert overlap(mask, mask_of(pile, PLANNED)) > 0.6


def test_where_a_whole_patch_was_not_measured_nothing_is_pointed_at(pile, mask_of):
    usual = mask_of(pile, PLANNED)
    rows, columns = np.nonzero(usual)
    hole = np.s_[rows.min() - 5 : rows.max() + 6, columns.min() - 5 : columns.max() + 6]
    depth_mm = measured_mm(pile)
    depth_mm[hole] = 0
    mask = mask_of(pile, PLANNED, depth_mm=depth_mm)
    assert mask.any()
    assert (mask & usual).sum() < 0.2 * usual.sum()


def test_where_nothing_may_be_dug_nothing_is_pointed_at(pile, mask_of):
    usual = mask_of(pile, PLANNED)
    x_w, y_w, _ = pile.plan.proposals[0].target.center_w
    barred = f"{x_w - 0.5:.2f},{y_w - 0.5:.2f},{x_w + 0.5:.2f},{y_w + 0.5:.2f}"
    other = mask_of(pile, f"{PLANNED}, keep_out: '{barred}'")
    assert other.any()
    assert overlap(usual, other) < 0.1
    with pytest.raises(MaskMissingError, match=r"no region of the pile is worth a cycle: .*barred by keep_out"):
        mask_of(pile, f"{PLANNED}, keep_out: '{EVERYWHERE}'")


def test_a_word_in_the_command_file_asks_for_the_next_region(pile, mask_of, tmp_path):
    command = tmp_path / "cycle.txt"
    command.write_text("1")
    masks = []

    def look(read):
        masks.extend([read(), read()])
        usual = masks[0]
        rows, columns = np.nonzero(usual)
        MeasuredCamera.depth_mm[rows.min() - 5 : rows.max() + 6, columns.min() - 5 : columns.max() + 6] = 0
        masks.append(read())
        command.write_text("2")
        masks.append(read())

    mask_of(pile, f"{PLANNED}, command: {command}", look=look)
    assert np.array_equal(masks[2], masks[0])
    assert masks[3].any()
    assert overlap(masks[3], masks[0]) < 0.2


@pytest.mark.parametrize("number", range(2))
def test_a_click_on_the_ground_marks_the_region_around_it(pile, mask_of, tmp_path, number):
    place_w = pile.plan.proposals[number].target.center_w
    mask = mask_of(pile, click_at(tmp_path / "live.toml", pile, place_w) + ", targets: regions")
    assert overlap(mask, true_region(pile, place_w)) > 0.7


def test_what_reaches_into_a_zone_or_out_of_reach_is_refused_whoever_points_there(pile, mask_of, tmp_path):
    place_w = pile.plan.proposals[0].target.center_w
    x_w, y_w, _ = place_w
    zone = f"keep_out: '{x_w - 0.1:.2f},{y_w - 0.1:.2f},{x_w + 0.1:.2f},{y_w + 0.1:.2f}'"
    live = tmp_path / "live.toml"
    clicked = click_at(live, pile, place_w)
    with pytest.raises(ConfigurationError, match="barred by keep_out"):
        mask_of(pile, f"{clicked}, targets: regions, {zone}")
    row, column = pile.camera.pixel(place_w)
    corners = [[(column + x) / WIDTH, (row + y) / HEIGHT] for x, y in ((-4, -4), (4, -4), (4, 4), (-4, 4))]
    live.write_text(f'[[mask]]\nkey = "live"\npolygon = {np.array(corners).tolist()}\n')
    assert mask_of(pile, f"source: manual, options: {live}, targets: regions").any()
    with pytest.raises(ConfigurationError, match="reaches into a zone"):
        mask_of(pile, f"source: manual, options: {live}, targets: regions, {zone}")
    with pytest.raises(ConfigurationError, match="m from the swing axis"):
        mask_of(pile, click_at(live, pile, np.array([3.5, 0.0, 0.0])) + ", targets: regions")


def test_a_camera_that_counts_in_tenths_of_a_millimetre_says_so_in_its_calibration(blocks, mask_of, tmp_path):
    clicked = click_at(tmp_path / "live.toml", blocks, blocks.place_w(blocks.command))
    tenths = np.rint(1e4 * blocks.depth_m()).clip(max=65535).astype(np.uint16)
    mask = mask_of(blocks, clicked, depth_mm=tenths, unit_m=1e-4)
    assert overlap(mask, mask_of(blocks, clicked)) > 0.9


@pytest.mark.parametrize(("width", "is_filled"), [(1, True), (6, True), (7, False), (20, False)])
def test_a_narrow_hole_is_filled_and_a_wide_one_stays_whole(width, is_filled):
    depth_mm = np.full((40, 40, 1), 5000, np.uint16)
    depth_mm[10 : 10 + width, 10 : 10 + width] = 0
    depth_m = registered_depth_m(depth_mm, np.zeros((40, 40, 3), np.uint8), camera="top", unit_m=1e-3)
    assert np.isnan(depth_m).sum() == (0 if is_filled else width * width)
    assert np.nanmax(np.abs(depth_m - 5.0)) < 1e-6


def test_a_click_on_an_object_marks_the_object(blocks, mask_of, tmp_path):
    mask = mask_of(blocks, click_at(tmp_path / "live.toml", blocks, blocks.place_w(blocks.command)))
    assert overlap(mask, blocks.true_mask(blocks.command)) > 0.7


def test_a_vision_language_model_is_shown_the_depth_and_its_place_is_marked(pile, mask_of, monkeypatch):
    row, column = pile.camera.pixel(pile.plan.proposals[1].target.center_w)
    box = [column - 5, row - 5, column + 5, row + 5]
    shown = []

    def ask(self, pictures, question):
        shown.extend(pictures)
        return Answer(json.dumps({"box": box, "reason": "much sand"}), (HEIGHT, WIDTH))

    monkeypatch.setattr(VisionLanguageModel, "ask", ask)
    monkeypatch.setattr(SegmentAnything, "pixels", lambda self, picture, box: np.ones(picture.shape[:2], bool))
    mask = mask_of(pile, "source: vlm_dig, targets: regions")
    assert overlap(mask, true_region(pile, pile.plan.proposals[1].target.center_w)) > 0.5
    assert np.array_equal(shown[0], pile.picture())
    assert shown[1].std() > 20.0


@pytest.mark.parametrize(
    ("mask", "changes", "error", "words"),
    [
        (PLANNED, {"use_depth": "false"}, DeviceError, "use_depth: true"),
        (
            PLANNED,
            {"depth_mm": np.zeros((HEIGHT, WIDTH), np.uint16)},
            DeviceError,
            "empty",
        ),
        (
            PLANNED,
            {"depth_mm": np.ones((96, 128), np.uint16)},
            ConfigurationError,
            "regist",
        ),
        ("source: geometry", {}, ConfigurationError, "give targets: regions"),
        ("source: click, options: m.toml", {}, ConfigurationError, "does not look at depth"),
        ("source: grounded_sam, text: sand", {}, ConfigurationError, "does not look at depth"),
        (f"{PLANNED}, snap: true", {}, ConfigurationError, "snap takes objects"),
        ("source: vlm_dig", {}, ConfigurationError, "give targets: regions"),
        ("source: manual, options: m.toml, keep_out: '0,0,1,1'", {}, ConfigurationError, "no effect"),
        ("source: oracle, targets: regions", {}, ConfigurationError, "asks a simulator"),
    ],
)
def test_what_cannot_be_is_refused(pile, mask_of, mask, changes, error, words):
    with pytest.raises((error, draccus.utils.DecodingError)) as raised:
        mask_of(pile, mask, **changes)
    assert words in str(raised.value) + str(raised.value.__cause__)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("position_w = [0, 0, 1]\nfovy_deg = 40", "give target_w or axes_w"),
        ("position_w = [0, 0, 1]\ntarget_w = [0, 0, 0]\nfovy_deg = 40", "straight above or below"),
        ("position_w = [0, 0, 1]\ntarget_w = [1, 0, 0]\nfovy_deg = 0", "fovy_deg"),
        ("position_w = [0, 0, nan]\ntarget_w = [1, 0, 0]\nfovy_deg = 40", "position_w"),
        ("position_w = [0, 0, 1]\naxes_w = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]\nfovy_deg = 40", "no rotation"),
        ("position_w = [0, 0, 1]\ntarget_w = [1, 0, 0]\nfovy_deg = 40\nfocal = 3", "focal"),
        ("position_w", "cannot be read"),
    ],
)
def test_a_calibration_that_says_too_little_or_too_much_is_refused(tmp_path, text, words):
    (tmp_path / "calibration.toml").write_text(text)
    with pytest.raises(ConfigurationError, match=words):
        read_calibration(tmp_path / "calibration.toml")


@given(st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9), st.floats(5.0, 120.0))
def test_a_camera_that_stands_anyhow_comes_back_from_its_file(tmp_path_factory, numbers, fovy_deg):
    axes_w, triangle = np.linalg.qr(np.reshape(numbers, (3, 3)) + 2.0 * np.eye(3))
    axes_w[:, 0] *= np.linalg.det(axes_w)  # no mirror
    camera = PinholeCamera(
        position_w=triangle[0], axes_w=axes_w, fovy_rad=np.deg2rad(fovy_deg), height=HEIGHT, width=WIDTH
    )
    path = tmp_path_factory.mktemp("calibration") / "camera.toml"
    path.write_text(calibration_text(camera))
    back = read_calibration(path).camera(HEIGHT, WIDTH)
    for name in ("position_w", "axes_w", "fovy_rad"):
        assert np.allclose(getattr(back, name), getattr(camera, name), atol=1e-12)


def test_an_upright_camera_looks_at_its_target():
    calibration = Calibration(position_w=(1.0, -2.0, 3.0), target_w=(0.5, 0.25, 0.0), fovy_deg=40.0)
    camera = calibration.camera(HEIGHT, WIDTH)
    assert camera.pixel(np.array(calibration.target_w)) == pytest.approx((0.5 * HEIGHT - 0.5, 0.5 * WIDTH - 0.5))
    above = camera.pixel(np.add(calibration.target_w, (0.0, 0.0, 0.1)))
    assert above[0] < 0.5 * HEIGHT - 1.0
