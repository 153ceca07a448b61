"""A lab's own arm, from its recordings to a robot that acts where it is pointed at: masks, training, rollout.

Six joints, two cameras of 480 x 640 at 30 frames a second, videos as LeRobot writes them; none of the robot's classes
knows of masks.
"""

import logging
import signal
import sys
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from lerobot.cameras import CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.robots import Robot, RobotConfig
from lerobot.scripts import lerobot_rollout, lerobot_train

import lerobot_excav.plugin  # noqa: F401 - registers the types
from lerobot_excav.scripts.main import main

from .cameras.test_mask_camera import PaintedCamera

pytestmark = pytest.mark.slow

JOINTS = [f"joint_{number}.pos" for number in range(1, 7)]
HEIGHT, WIDTH, FPS = 480, 640, 30
MASK = "observation.images.target_mask"


@RobotConfig.register_subclass("bench_arm")
@dataclass(kw_only=True)
class BenchArmConfig(RobotConfig):
    """Six joints on somebody's bench."""

    cameras: dict[str, CameraConfig] = field(default_factory=dict)


class BenchArm(Robot):
    config_class, name = BenchArmConfig, "bench_arm"
    actions: list = []  # noqa: RUF012 - what all of them were told

    def __init__(self, config):
        super().__init__(config)
        self.cameras = make_cameras_from_configs(config.cameras)
        self.pos = dict.fromkeys(JOINTS, 0.0)

    @property
    def observation_features(self):
        size = {name: (camera.height, camera.width, 3) for name, camera in self.cameras.items()}
        return {**dict.fromkeys(JOINTS, float), **size}

    @property
    def action_features(self):
        return dict.fromkeys(JOINTS, float)

    @property
    def is_connected(self):
        return all(camera.is_connected for camera in self.cameras.values())

    is_calibrated = True

    def connect(self, calibrate=True):  # noqa: FBT002 - LeRobot's own signature
        for camera in self.cameras.values():
            camera.connect()

    def calibrate(self):
        pass

    def configure(self):
        pass

    def get_observation(self):
        return {**self.pos, **{name: camera.async_read() for name, camera in self.cameras.items()}}

    def send_action(self, action):
        BenchArm.actions.append(action)
        self.pos = {name: float(value) for name, value in action.items()}
        return action

    def disconnect(self):
        for camera in self.cameras.values():
            camera.disconnect()


# Where LeRobot looks for the class that belongs to a configuration.
BenchArmConfig.__module__ = "bench_arm.config_bench_arm"
sys.modules["bench_arm"] = SimpleNamespace(BenchArm=BenchArm)


def painted(column=300):
    """A grey table with a red block whose left edge is at a column."""
    picture = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    picture[200:240, column : column + 40] = (200, 30, 30)
    return picture


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Two episodes of twelve frames, as LeRobot records them."""
    root = tmp_path_factory.mktemp("bench") / "recorded"
    names = {"names": JOINTS, "shape": (6,), "dtype": "float32"}
    camera = {"dtype": "video", "shape": (HEIGHT, WIDTH, 3), "names": ["height", "width", "channels"]}
    features = {f"observation.images.{name}": camera for name in ("top", "wrist")}
    features |= {"observation.state": names, "action": names}
    dataset = LeRobotDataset.create("lab/bench", FPS, features, root, robot_type="bench_arm")
    rng = np.random.default_rng(0)
    for episode in range(2):
        for frame in range(12):
            joints = np.linspace(0.0, 0.1 * frame, 6, dtype=np.float32)
            dataset.add_frame(
                {
                    "observation.images.top": painted(200 + 150 * episode),
                    "observation.images.wrist": painted(20 * frame),
                    "observation.state": joints,
                    "action": joints + rng.normal(0.0, 0.01, 6).astype(np.float32),
                    "task": "take the block",
                }
            )
        dataset.save_episode()
    dataset.finalize()
    return root


@pytest.fixture
def run(monkeypatch):
    """Run a command of LeRobot's; it replaces the handlers of the root logger and of signals."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    signals = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)}

    def _run(command, *flags):
        monkeypatch.setattr(sys, "argv", ["command", *flags])
        command.main()

    yield _run
    root.setLevel(level)
    root.handlers[:] = handlers
    for each, handler in signals.items():
        signal.signal(each, handler)


def drawn(path, *keys):
    """Write a file that marks the block of an episode, or of the camera, by a polygon."""
    entries = []
    for key, left in keys:
        x0, x1, y0, y1 = left / WIDTH, (left + 40) / WIDTH, 200 / HEIGHT, 240 / HEIGHT
        corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
        entries.append(f'[[mask]]\nkey = "{key}"\npolygon = {corners}\n')
    path.write_text("".join(entries))
    return path


def test_recordings_get_masks_a_policy_learns_them_and_the_robot_is_driven_by_a_live_one(
    recorded, run, tmp_path, monkeypatch
):
    masked, train = tmp_path / "masked", tmp_path / "train"
    told = drawn(tmp_path / "drawn.toml", ("episode/0", 200), ("episode/1", 350))
    top = "--main_camera=observation.images.top"
    assert main(["masks", str(recorded), "--source=manual", f"--mask.options={told}", top, f"--out={masked}"]) == 0
    dataset = LeRobotDataset("lab/masked", root=masked)
    for index, left in ((0, 200), (12, 350)):
        rows, columns = np.nonzero(dataset[index][MASK][0].numpy() > 0.5)
        assert (rows.min(), columns.min(), columns.max()) == (200, left, left + 39)

    run(
        lerobot_train,
        *(
            "--policy.type=mask_act",
            "--policy.preset=fast",
            "--policy.n_encoder_layers=1",
            "--policy.resize_to=[48,64]",
        ),
        *("--policy.main_camera=observation.images.top", "--policy.chunk_size=4", "--policy.actions_per_token=1"),
        *("--policy.target_token=true", "--policy.device=cpu", "--policy.push_to_hub=false", "--wandb.enable=false"),
        *("--dataset.repo_id=lab/masked", f"--dataset.root={masked}", f"--output_dir={train}"),
        *("--batch_size=2", "--steps=2", "--num_workers=0", "--log_freq=1"),
    )
    policy = train / "checkpoints" / "last" / "pretrained_model"

    monkeypatch.setattr(PaintedCamera, "picture", painted(420))
    live = drawn(tmp_path / "live.toml", ("live", 420))
    size = f"width: {WIDTH}, height: {HEIGHT}"
    camera = f"{{type: painted, fps: {FPS}, {size}}}"
    cameras = f"{{top: {{type: shared, name: top, camera: {camera}}}, wrist: {camera}, "
    cameras += f"target_mask: {{type: mask, of: top, source: manual, options: {live}, {size}}}}}"
    BenchArm.actions.clear()
    run(
        lerobot_rollout,
        *("--robot.type=bench_arm", f"--robot.cameras={cameras}", f"--robot.calibration_dir={tmp_path}"),
        *(f"--policy.path={policy}", "--policy.device=cpu", "--strategy.type=base", "--task=take the block"),
        *(f"--fps={FPS}", "--duration=4", "--play_sounds=false", "--return_to_initial_position=false"),
    )
    assert len(BenchArm.actions) > 3
    assert all(np.isfinite(list(action.values())).all() and set(action) == set(JOINTS) for action in BenchArm.actions)
