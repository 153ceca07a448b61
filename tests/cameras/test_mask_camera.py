"""A mask as one more camera of anybody's robot, whose class knows nothing of it."""

import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import draccus
import numpy as np
import pytest
from lerobot.cameras import Camera, CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs

import lerobot_excav.plugin  # noqa: F401 - registers the types
from lerobot_excav.cameras.shared_camera.shared_camera import SharedCamera
from lerobot_excav.envs.masks.source import MaskMissingError, TargetMask, register_mask_source
from lerobot_excav.errors import ConfigurationError, DeviceError

HEIGHT, WIDTH = 48, 64


@CameraConfig.register_subclass("painted")
@dataclass(kw_only=True)
class PaintedCameraConfig(CameraConfig):
    """A camera that shows what a test has painted."""


class PaintedCamera(Camera):
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)

    def __init__(self, config):
        super().__init__(config)
        self.is_open = False

    @property
    def is_connected(self):
        return self.is_open

    @staticmethod
    def find_cameras():
        return []

    def connect(self, warmup=True):  # noqa: FBT002 - LeRobot's own signature
        self.is_open = True

    def disconnect(self):
        self.is_open = False

    def read(self):
        return self.picture.copy()

    def async_read(self, timeout_ms=200.0):
        return self.read()

    def read_latest(self, max_age_ms=500):
        return self.read()


# Where LeRobot looks for the class that belongs to a configuration.
PaintedCameraConfig.__module__ = "painted_camera.config_painted_camera"
sys.modules["painted_camera"] = SimpleNamespace(PaintedCamera=PaintedCamera)


class ColourSource:
    """Marks the pixels of the channel that the words name."""

    asked = 0

    def mask(self, view, command):
        ColourSource.asked += 1
        words = view.words(command)
        pixels = view.picture()[..., ("red", "green", "blue").index(words)] > 100
        return TargetMask(pixels=pixels, target_id=0, source="colour") if pixels.any() else None


register_mask_source("colour_of_words", ColourSource)


@dataclass
class AnyRobotConfig:
    cameras: dict[str, CameraConfig]


def cameras_of(text):
    return make_cameras_from_configs(draccus.parse(AnyRobotConfig, args=[f"--cameras={text}"]).cameras)


SIZE = f"width: {WIDTH}, height: {HEIGHT}"
TOP = f"top: {{type: shared, name: top, camera: {{type: painted, fps: 30, {SIZE}}}}}"


@pytest.fixture
def connected(monkeypatch):
    made = []

    def _connect(mask):
        cameras = cameras_of(f"{{{TOP}, target_mask: {{type: mask, of: top, {SIZE}, {mask}}}}}")
        made.extend(cameras.values())
        for camera in cameras.values():
            camera.connect()
        return cameras

    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[10:20, 30:40, 0] = 255
    picture[5:9, 2:12, 1] = 255
    monkeypatch.setattr(PaintedCamera, "picture", picture)
    yield _connect
    for camera in made:
        if camera.is_connected:
            camera.disconnect()


def test_a_drawn_mask_is_a_camera_of_the_same_size(connected, tmp_path):
    path = tmp_path / "drawn.toml"
    path.write_text('[[mask]]\nkey = "live"\npolygon = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]\n')
    cameras = connected(f"source: manual, options: {path}")
    assert np.array_equal(cameras["top"].async_read(), PaintedCamera.picture)
    mask = cameras["target_mask"].async_read()
    assert mask.shape == (HEIGHT, WIDTH, 3)
    assert set(np.unique(mask)) == {0, 255}
    assert mask[:, :, 0].mean() == pytest.approx(0.25 * 255)
    assert (cameras["top"].width, cameras["top"].height, cameras["top"].fps) == (WIDTH, HEIGHT, 30)


def test_the_mask_stays_until_the_command_changes(connected, tmp_path, monkeypatch):
    command = tmp_path / "command.txt"
    command.write_text("red\n")
    monkeypatch.setattr(
        "lerobot_excav.cameras.mask_camera.mask_camera.make_mask_source", lambda *_, **__: ColourSource()
    )
    camera = connected(f"source: colour_of_words, command: {command}")["target_mask"]
    first, asked = camera.read(), ColourSource.asked
    PaintedCamera.picture[:] = np.roll(PaintedCamera.picture, 7, axis=1)
    assert np.array_equal(camera.read(), first)
    assert ColourSource.asked == asked
    command.write_text("green")
    assert not np.array_equal(camera.read_latest(), first)
    assert ColourSource.asked == asked + 1
    command.write_text("blue")
    with pytest.raises(MaskMissingError, match="finds nothing in the picture of 'top' for 'blue'"):
        camera.read()
    command.unlink()
    with pytest.raises(ConfigurationError, match="cannot be read"):
        camera.read()


def drawn(path, left):
    """Write a file of one mask, half as wide and high as the picture, that begins at a share of its width."""
    corners = [[left, 0.25], [left + 0.5, 0.25], [left + 0.5, 0.75], [left, 0.75]]
    path.write_text(f'[[mask]]\nkey = "live"\npolygon = {corners}\n')
    return path


def test_the_mask_is_made_again_when_its_file_changes(connected, tmp_path):
    path = drawn(tmp_path / "live.toml", 0.25)
    camera = connected(f"source: manual, options: {path}")["target_mask"]
    first = camera.read()
    assert np.array_equal(camera.read(), first)
    drawn(path, 0.5)
    assert np.array_equal(camera.read(), np.roll(first, WIDTH // 4, axis=1))
    path.unlink()
    with pytest.raises(ConfigurationError, match="of the mask camera cannot be read"):
        camera.read()


def test_a_mask_is_snapped_if_the_camera_says_so(connected, tmp_path, monkeypatch):
    class Aside:
        """Snaps each mask one pixel to the right."""

        def snap(self, mask, view):
            return replace(mask, pixels=np.roll(mask.pixels, 1, axis=1))

    monkeypatch.setattr("lerobot_excav.envs.masks.snapped.Snapper", Aside)
    path = drawn(tmp_path / "live.toml", 0.25)
    plain = connected(f"source: manual, options: {path}")
    shown = plain["target_mask"].read()
    for camera in plain.values():
        camera.disconnect()
    snapped = connected(f"source: manual, options: {path}, snap: true")["target_mask"].read()
    assert np.array_equal(snapped, np.roll(shown, 1, axis=1))


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        ("source: crystal_ball", "crystal_ball"),
        ("source: vlm_dig", "give targets: regions"),
        ("source: colour_of_words, text: red, command: c.txt", "give one of them"),
    ],
)
def test_what_cannot_be_is_refused_at_once(mask, words):
    with pytest.raises(Exception, match=words):
        cameras_of(f"{{target_mask: {{type: mask, of: top, {SIZE}, {mask}}}}}")


def test_a_shared_camera_that_is_missing_of_another_size_or_there_twice_is_named(connected, tmp_path):
    path = tmp_path / "drawn.toml"
    path.write_text('[[mask]]\nkey = "*"\npolygon = [[0, 0], [1, 0], [1, 1]]\n')
    (mask,) = cameras_of(f"{{m: {{type: mask, of: nobody, source: manual, options: {path}, {SIZE}}}}}").values()
    with pytest.raises(DeviceError, match="is not connected"):
        mask.read()
    mask.connect()
    with pytest.raises(DeviceError, match="no shared camera 'nobody' is connected"):
        mask.read()
    cameras = connected(f"source: manual, options: {path}")
    (small,) = cameras_of(
        f"{{m: {{type: mask, of: top, source: manual, options: {path}, width: 8, height: 8}}}}"
    ).values()
    small.connect()
    with pytest.raises(ConfigurationError, match="give both the same size"):
        small.read()
    (twin,) = cameras_of(f"{{{TOP}}}").values()
    with pytest.raises(DeviceError, match="two shared cameras are called 'top'"):
        twin.connect()
    cameras["top"].disconnect()
    assert "top" not in SharedCamera.connected


def test_a_size_that_contradicts_the_camera_is_refused():
    text = f"{{top: {{type: shared, name: top, width: 8, camera: {{type: painted, fps: 30, {SIZE}}}}}}}"
    with pytest.raises(Exception, match="its camera says 64"):
        cameras_of(text)
