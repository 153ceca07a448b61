"""Depth over the network: what a machine measures is what a camera reads, and what masks are made of."""

import signal
import subprocess
import sys
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lerobot_excav.cameras.mask_camera.calibration import read_calibration
from lerobot_excav.cameras.stream_camera.config_stream_camera import StreamCameraConfig
from lerobot_excav.cameras.stream_camera.stream_camera import StreamCamera
from lerobot_excav.envs.machines.excavator.cameras import MAIN
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.testbed.picture_stream import PictureServer

from .conftest import until

SIZE = (6, 8)
COLOURS = np.full((*SIZE, 3), 7, np.uint8)


@pytest.fixture(scope="module")
def server():
    with closing(PictureServer("127.0.0.1", 0)) as served:
        yield served


@pytest.fixture
def camera(server):
    made = []

    def _camera(name="main", **settings):
        height, width = SIZE
        config = StreamCameraConfig(
            port=server.port, name=name, fps=10, height=height, width=width, timeout_s=1.0, **settings
        )
        made.append(StreamCamera(config))
        return made[-1]

    yield _camera
    for each in made:
        each.disconnect()


@given(depth_mm=arrays(np.uint16, SIZE), number=st.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_every_millimetre_arrives(server, depth_mm, number):
    name = f"camera{number}"
    server.show(name, 1, COLOURS)
    server.show(f"{name}_depth", 1, depth_mm, lossless=True)
    config = StreamCameraConfig(port=server.port, name=name, fps=10, height=6, width=8, use_depth=True)
    reading = StreamCamera(config)
    reading.connect()
    read = reading.read_latest_depth()
    reading.disconnect()
    assert read.dtype == np.uint16
    assert np.array_equal(read, depth_mm[..., None])


def test_who_does_not_ask_for_depth_gets_none(server, camera):
    server.show("main", 1, COLOURS)
    plain = camera()
    plain.connect()
    assert not plain.use_depth
    with pytest.raises(DeviceError, match="use_depth: true"):
        plain.read_latest_depth()


def test_a_machine_without_depth_is_refused_at_once_by_who_asks_for_it(server, camera):
    server.show("blind", 1, COLOURS)
    asking = camera("blind", use_depth=True)
    with pytest.raises(DeviceError, match="offers no depth of 'blind'"):
        asking.connect()
    assert not asking.is_connected


def test_depth_is_that_of_the_picture_and_is_waited_for_only_so_long(server, camera):
    def show(taken_us, value, *, depth_too=True):
        server.show("paired", taken_us, COLOURS + np.uint8(value))
        if depth_too:
            server.show("paired_depth", taken_us, np.full(SIZE, value, np.uint16), lossless=True)

    show(1, 1)
    paired = camera("paired", use_depth=True, max_age_s=2.0)
    paired.connect()
    for number in range(2, 20):
        show(number, number)
        value = paired.async_read()[0, 0, 0] - 7
        assert paired.read_latest_depth()[0, 0, 0] >= value
    show(20, 20, depth_too=False)
    until(lambda: paired.async_read()[0, 0, 0] == 27)
    with pytest.raises(DeviceError, match=r"no picture of 'paired_depth' came within 2\.00 s"):
        paired.read_latest_depth()


def test_depth_is_not_taken_for_a_picture_nor_a_picture_for_depth(server, camera):
    server.show("odd", 1, np.zeros(SIZE, np.uint16), lossless=True)
    with pytest.raises(ConfigurationError, match="1 channels in place of 3"):
        camera("odd").connect()
    server.show("even", 1, COLOURS)
    server.show("even_depth", 1, COLOURS)
    with pytest.raises(ConfigurationError, match="3 channels in place of 1"):
        camera("even", use_depth=True).connect()


@pytest.mark.slow
def test_the_emulator_measures_depth_and_says_where_its_camera_stands(camera, tmp_path):
    path, other = tmp_path / "made/main.toml", tmp_path / "measured.toml"
    other.write_text("position_w = [0, 0, 1]")
    command = [sys.executable, "-m", "lerobot_excav.scripts.main", "testbed-emulator", "--port=0", "--picture_port=0"]
    process = subprocess.Popen(
        [*command, f"--calibration={path}", "--env.fidelity=fast"], stdout=subprocess.PIPE, text=True
    )
    try:
        lines = [process.stdout.readline() for _ in range(2)]
        port = int(lines[1].rsplit(":", 1)[1])
        config = StreamCameraConfig(port=port, name="main", fps=10, height=96, width=128, use_depth=True)
        main = StreamCamera(config)
        main.connect()
        depth_mm = main.read_latest_depth()
        main.disconnect()
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30.0) == 0
    assert subprocess.run([*command, f"--calibration={other}"], capture_output=True, check=False).returncode != 0
    assert other.read_text() == "position_w = [0, 0, 1]"
    seen = read_calibration(path).camera(96, 128)
    assert np.allclose(seen.position_w, MAIN.position)
    points_w = seen.points_w(1e-3 * depth_mm[..., 0].astype(float))
    measured = depth_mm[..., 0] > 0
    assert measured.mean() > 0.9
    heights_m = points_w[..., 2][measured]
    assert np.percentile(heights_m, 1) > -0.05  # most is ground, and nothing lies below it
    assert abs(np.median(heights_m)) < 0.05
    assert 1.0 < heights_m.max() < 5.0  # the machine
