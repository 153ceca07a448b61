"""The test bed under LeRobot's commands that record, play again and teleoperate, against the emulator."""

import json
import logging
import re
import sys
from contextlib import closing
from dataclasses import dataclass
from types import SimpleNamespace

import draccus
import numpy as np
import pytest
from lerobot.configs.dataset import DatasetRecordConfig
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.robots import make_robot_from_config
from lerobot.scripts import lerobot_record, lerobot_replay, lerobot_teleoperate
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401 - registers the types
from lerobot_excav.cameras.mask_camera.calibration import calibration_text
from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_testbed.config_excavator_testbed import ExcavatorTestbedConfig
from lerobot_excav.robots.recording_command import LOSSLESS_FLAGS, require_command_for_machine
from lerobot_excav.scripts.main import main

from ..testbed.conftest import emulated

SIZE = {"observation_height": 96, "observation_width": 128}
RATES = (10, 25, 50)


@TeleoperatorConfig.register_subclass("leftward")
@dataclass(kw_only=True)
class LeftwardConfig(TeleoperatorConfig):
    """Somebody who holds one stick to the left."""


class Leftward(Teleoperator):
    config_class, name = LeftwardConfig, "leftward"
    action_features = dict.fromkeys(ACTION_NAMES, float)
    feedback_features = {}  # noqa: RUF012 - LeRobot's own form
    is_connected = False
    is_calibrated = True

    def connect(self, calibrate=True):  # noqa: FBT002 - LeRobot's own signature
        self.is_connected = True

    def disconnect(self):
        self.is_connected = False

    def calibrate(self):
        pass

    def configure(self):
        pass

    def send_feedback(self, feedback):
        pass

    def get_action(self):
        return {**dict.fromkeys(ACTION_NAMES, 0.0), "swing.vel": 0.5}


# Where LeRobot looks for the class that belongs to a configuration.
LeftwardConfig.__module__ = "leftward.config_leftward"
sys.modules["leftward"] = SimpleNamespace(Leftward=Leftward)


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run a command of LeRobot's on a served machine; it replaces the handlers of the root logger."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)

    def _run(command, served, *flags, cameras="{}"):
        robot = ["--robot.type=excavator_testbed", "--robot.address={}:{}".format(*served.emulator.address)]
        robot += [f"--robot.calibration_dir={tmp_path}", f"--robot.alignment_log={tmp_path / 'alignment.jsonl'}"]
        robot += [f"--robot.cameras={cameras}"]
        monkeypatch.setattr(sys, "argv", ["command", *robot, *flags])
        command()

    yield _run
    root.setLevel(level)
    root.handlers[:] = handlers


def swing(served):
    return served.site._env.world.machine.joint_pos[0]


def data_flags(root, **changes):
    values = {"repo_id": "someone/driven", "root": root, "single_task": "dig", "fps": 10, "video": "false"}
    values |= {"num_episodes": 1, "episode_time_s": 2, "reset_time_s": 0, "push_to_hub": "false", "no_stamp": "true"}
    return [f"--dataset.{name}={value}" for name, value in (values | changes).items()]


def cameras_of(served, mask_file):
    """The machine's main camera, shared, and a mask that a person has drawn for it."""
    size = "width: 128, height: 96"
    stream = f"{{type: stream, port: {served.emulator.picture_address[1]}, name: main, fps: 10, {size}}}"
    mask = f"{{type: mask, of: main, source: manual, options: {mask_file}, {size}}}"
    return f"{{main: {{type: shared, name: main, camera: {stream}}}, target_mask: {mask}}}"


@pytest.mark.slow
def test_a_person_records_it_with_a_mask_of_a_file_the_ages_are_added_and_it_is_played_again(run, tmp_path):
    drawn = tmp_path / "live.toml"
    drawn.write_text('[[mask]]\nkey = "live"\npolygon = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]\n')
    teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}", "--play_sounds=false"]
    with emulated(SIZE) as served:
        start = swing(served)
        cameras = cameras_of(served, drawn)
        run(lerobot_record.main, served, *teleop, *data_flags(tmp_path / "data"), cameras=cameras)
        driven = swing(served) - start
    assert driven > 0.05
    dataset = LeRobotDataset("someone/driven", root=tmp_path / "data")
    assert np.stack([dataset[i]["action"].numpy()[0] for i in range(len(dataset))]) == pytest.approx(0.5)
    assert float(dataset[3]["observation.images.target_mask"].mean()) == pytest.approx(0.25)
    lines = [json.loads(line) for line in (tmp_path / "alignment.jsonl").read_text().splitlines()][1:]
    assert [line["frame_index"] for line in lines] == list(range(len(dataset)))
    aligned = [
        "alignment",
        str(tmp_path / "data"),
        f"--log={tmp_path / 'alignment.jsonl'}",
        f"--out={tmp_path / 'out'}",
    ]
    assert main(aligned) in (0, 1)  # 1: a busy machine was late in some frame, and says so
    assert LeRobotDataset("someone/driven", root=tmp_path / "out")[3]["excav.state_age_ms"] >= 0.0
    (tmp_path / "alignment.jsonl").unlink()
    with emulated(SIZE) as served:
        start = swing(served)
        played = ["--dataset.repo_id=someone/driven", f"--dataset.root={tmp_path / 'data'}", "--dataset.episode=0"]
        run(lerobot_replay.main, served, *played, "--play_sounds=false")
        assert swing(served) - start == pytest.approx(driven, rel=0.5)


@pytest.mark.slow
def test_a_person_teleoperates_it(run, tmp_path):
    with emulated(SIZE) as served:
        start = swing(served)
        teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}"]
        run(lerobot_teleoperate.main, served, *teleop, "--fps=25", "--teleop_time_s=2")
        assert swing(served) - start > 0.05


CAMERAS = "--robot.cameras={target_mask: {type: stream, port: 47501, name: target_mask, fps: 10, width: 8, height: 8}}"


@pytest.mark.parametrize(
    ("flags", "has_mask", "advice"),
    [
        (["--dataset.fps=30", "--dataset.video=false"], False, r"it records 30 frames a second\..*--dataset\.fps=25$"),
        (["--dataset.fps=5", "--dataset.video=false"], False, r"--dataset\.fps=10$"),
        (["--dataset.fps=10"], True, r"Give --dataset\.video=false"),
        (["--dataset.fps=10"], False, None),
        (["--dataset.fps=50", "--dataset.video=false"], True, None),
    ],
)
def test_a_rate_that_does_not_divide_that_of_the_wire_and_a_lossy_mask_are_refused(tmp_path, flags, has_mask, advice):
    robot = ["--robot.type=excavator_testbed", f"--robot.calibration_dir={tmp_path}", *([CAMERAS] if has_mask else [])]
    teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}"]
    data = ["--dataset.repo_id=a/b", "--dataset.single_task=dig", f"--dataset.root={tmp_path / 'data'}"]
    config = draccus.parse(lerobot_record.RecordConfig, args=[*robot, *teleop, *data, *flags])
    if advice is None:
        require_command_for_machine(config.robot, rates=RATES, has_mask=has_mask)
        return
    with pytest.raises(ConfigurationError, match=advice):
        require_command_for_machine(config.robot, rates=RATES, has_mask=has_mask)


MASK = "{goal: {type: mask, of: main, source: manual, options: x.toml, width: 8, height: 8}}"


@pytest.mark.parametrize("cameras", [CAMERAS.partition("=")[2], MASK], ids=["by its name", "by its type"])
def test_a_robot_whose_mask_would_be_blurred_is_not_even_made(tmp_path, cameras):
    robot = ["--robot.type=excavator_testbed", f"--robot.calibration_dir={tmp_path}", f"--robot.cameras={cameras}"]
    teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}"]
    data = ["--dataset.repo_id=a/b", "--dataset.single_task=dig", "--dataset.fps=10"]
    config = draccus.parse(lerobot_record.RecordConfig, args=[*robot, *teleop, *data])
    with pytest.raises(ValueError, match=r"blurs the target mask.*Give --dataset\.video=false"):
        make_robot_from_config(config.robot)


@dataclass
class Rollout:
    """The fields of LeRobot's configuration that count; its own loads a policy."""

    robot: ExcavatorTestbedConfig
    fps: float = 10.0
    interpolation_multiplier: int = 1
    dataset: object = None


@pytest.mark.parametrize(
    ("changes", "advice"),
    [
        ({"fps": 50.0, "dataset": DatasetRecordConfig(fps=10, video=False)}, r"Give --dataset\.fps=50$"),
        (
            {"interpolation_multiplier": 5, "dataset": DatasetRecordConfig(fps=10, video=False)},
            r"stores every observation 5 times.*Give --interpolation_multiplier=1$",
        ),
        ({"interpolation_multiplier": 3}, r"it sends 30\..*Give --interpolation_multiplier=1$"),
        ({"fps": 30.0}, r"it sends 30\..*Give --fps=25$"),
        ({"fps": 30.0, "interpolation_multiplier": 2}, r"Give --fps=50 --interpolation_multiplier=1$"),
        ({"interpolation_multiplier": 5}, None),
        ({"fps": 25.0, "dataset": DatasetRecordConfig(fps=25, video=False)}, None),
    ],
)
def test_a_rollout_is_sent_and_recorded_at_one_rate(changes, advice):
    command = Rollout(ExcavatorTestbedConfig(), **changes)
    if advice is None:
        require_command_for_machine(command.robot, rates=RATES, has_mask=False)
        return
    with pytest.raises(ConfigurationError, match=advice):
        require_command_for_machine(command.robot, rates=RATES, has_mask=False)


def test_a_robot_is_not_even_made_for_a_command_of_another_rate(tmp_path):
    robot = ["--robot.type=excavator_testbed", f"--robot.calibration_dir={tmp_path}"]
    teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}"]
    config = draccus.parse(lerobot_teleoperate.TeleoperateConfig, args=[*robot, *teleop])  # LeRobot's own 60
    with pytest.raises(ValueError, match=r"takes 10, 25, 50 actions a second: it sends 60\..*Give --fps=50$"):
        make_robot_from_config(config.robot)


@pytest.mark.slow
@pytest.mark.parametrize("video", ["false", "true"])
def test_depth_is_recorded_beside_the_pictures_and_the_planner_points_by_it(run, tmp_path, video):
    calibration = tmp_path / "main.toml"
    with closing(ExcavatorEnv(scene_set="train", fidelity="fast", render_mode=None, **SIZE)) as env:
        env.reset(options={"scene_id": 0, "target_id": 0})
        depth_m = env.depth_m()
    teleop = ["--teleop.type=leftward", f"--teleop.calibration_dir={tmp_path}", "--play_sounds=false"]
    with emulated(SIZE, has_depth=True) as served:
        calibration.write_text(calibration_text(served.site.camera))
        size = "width: 128, height: 96"
        port = served.emulator.picture_address[1]
        stream = f"{{type: stream, port: {port}, name: main, fps: 10, use_depth: true, {size}}}"
        mask = f"{{type: mask, of: main, source: geometry, targets: regions, calibration: {calibration}, {size}}}"
        cameras = f"{{main: {{type: shared, name: main, camera: {stream}}}, target_mask: {mask}}}"
        flags = data_flags(tmp_path / "data", video=video)
        if video == "true":
            flags += LOSSLESS_FLAGS.split()
            with pytest.raises(ValueError, match="depth_max=20") as raised:
                run(lerobot_record.main, served, *teleop, *flags, cameras=cameras)
            flags.append(re.search(r"Give (\S+)", str(raised.value.__cause__))[1])
        run(lerobot_record.main, served, *teleop, *flags, cameras=cameras)
    dataset = LeRobotDataset("someone/driven", root=tmp_path / "data")
    assert dataset.meta.features["observation.images.main_depth"]["info"]["is_depth_map"]
    recorded = np.asarray(dataset[0]["observation.images.main_depth"], float).squeeze()
    near = depth_m < 15.0
    assert (depth_m[near] > 10.5).any()
    is_same = np.abs(recorded - 1e3 * depth_m) < 30.0  # [mm]; a video has 12 bits, and the machine has moved
    assert is_same[near].mean() > 0.9
    assert is_same[near & (depth_m > 10.5)].mean() > 0.9
    marked = dataset[3]["observation.images.target_mask"].numpy()
    assert set(np.unique(marked)) == {0.0, 1.0}
    assert 0.001 < marked.mean() < 0.05
