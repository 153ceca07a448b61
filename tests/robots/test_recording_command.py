"""A command of LeRobot whose rate or storage does not suit the simulation is refused before anything is made."""

import logging
from dataclasses import dataclass, field
from types import SimpleNamespace

import draccus
import pytest
from lerobot.configs.dataset import DatasetRecordConfig
from lerobot.robots import make_robot_from_config
from lerobot.rollout.configs import DAggerStrategyConfig, HighlightStrategyConfig, SentryStrategyConfig
from lerobot.scripts import lerobot_record, lerobot_replay, lerobot_teleoperate

from lerobot_excav.envs.holder import holder_of
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.recording_command import LOSSLESS_FLAGS, operator_of, require_fitting_command

FITTING = ["--dataset.fps=10", "--dataset.video=false"]
RECORD = ["--robot.type=excavator_sim", "--dataset.repo_id=someone/data", "--dataset.single_task=go"]


@pytest.fixture
def record_config(tmp_path):
    """Parse the flags of a recording."""

    def _config(*flags):
        folders = [f"--{kind}.calibration_dir={tmp_path}" for kind in ("robot", "teleop")]
        fixed = [*RECORD, "--teleop.type=excavator_operator", *folders, f"--dataset.root={tmp_path / 'data'}"]
        return draccus.parse(lerobot_record.RecordConfig, args=[*fixed, *flags])

    return _config


@dataclass
class Rollout:
    """The fields of LeRobot's configuration that count; its own loads a policy."""

    robot: ExcavatorSimConfig
    fps: float = 10.0
    interpolation_multiplier: int = 1
    strategy: object = None
    dataset: object = field(default_factory=lambda: DatasetRecordConfig(fps=10, video=False))


def test_a_recording_with_lerobots_own_defaults_is_refused_before_its_folder_is_made(run_command, tmp_path):
    flags = [*RECORD, "--teleop.type=excavator_operator", f"--teleop.calibration_dir={tmp_path}"]
    with pytest.raises(ValueError, match=r"--dataset\.fps=30.*blurs.*Give --dataset\.fps=10 --dataset\.video=false"):
        run_command(lerobot_record.main, *flags, "--dataset.push_to_hub=false", "--dataset.no_stamp=true")
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("flags", "advice"),
    [
        (["--dataset.fps=30", "--dataset.video=false"], "Give --dataset.fps=10$"),
        (["--dataset.fps=10"], r"Give --dataset\.video=false \(or, .*--dataset\.rgb_encoder\.crf=0\)$"),
        (["--dataset.fps=10", *LOSSLESS_FLAGS.split()[:2]], "crf=30"),
        (["--dataset.fps=10", *LOSSLESS_FLAGS.split()[::2]], "pix_fmt=yuv420p"),
        (["--dataset.fps=10", "--dataset.rgb_encoder.vcodec=hevc", *LOSSLESS_FLAGS.split()[1:]], "vcodec=hevc"),
        (["--robot.fps=25", *FITTING], "Give --dataset.fps=25$"),
    ],
)
def test_a_wrong_rate_or_a_lossy_mask_is_refused_with_the_flags_that_mend_it(record_config, flags, advice):
    config = record_config(*flags)
    with pytest.raises(ConfigurationError, match=advice):
        require_fitting_command(config.robot)


@pytest.mark.parametrize(
    "flags",
    [FITTING, ["--dataset.fps=10", *LOSSLESS_FLAGS.split()], ["--robot.fps=25", "--dataset.fps=25", FITTING[1]]],
)
def test_a_fitting_recording_is_accepted(record_config, flags):
    config = record_config(*flags)
    assert holder_of(config.robot, "robot") is config
    require_fitting_command(config.robot)


@pytest.mark.parametrize(
    ("changes", "advice"),
    [
        ({"fps": 30.0}, "Give --fps=10$"),
        ({"fps": 5.0, "interpolation_multiplier": 2}, "Give --interpolation_multiplier=1 --fps=10$"),
        ({"fps": 10.0, "dataset": DatasetRecordConfig(video=False)}, "Give --dataset.fps=10$"),
        ({"dataset": None, "fps": 10.0, "interpolation_multiplier": 2}, "Give --fps=5$"),
    ],
)
def test_a_rollout_at_another_rate_is_refused(changes, advice):
    command = Rollout(ExcavatorSimConfig(), **changes)
    with pytest.raises(ConfigurationError, match=advice):
        require_fitting_command(command.robot)


@pytest.mark.parametrize("changes", [{}, {"dataset": None, "fps": 5.0, "interpolation_multiplier": 2}])
def test_a_rollout_at_the_robots_rate_is_accepted(changes):
    command = Rollout(ExcavatorSimConfig(), **changes)
    require_fitting_command(command.robot)


@pytest.mark.parametrize("strategy", [HighlightStrategyConfig(), DAggerStrategyConfig(), SentryStrategyConfig()])
def test_a_strategy_whose_episodes_start_within_a_run_says_that_it_leaves_no_session_log(strategy, caplog):
    command = Rollout(ExcavatorSimConfig(), strategy=strategy)
    require_fitting_command(command.robot)
    said = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    if strategy.type == "sentry":
        assert said == []
    else:
        assert [f"--strategy.type={strategy.type}" in message for message in said] == [True]


def test_teleoperation_at_lerobots_own_rate_is_refused(tmp_path):
    robot = f"--robot.type=excavator_sim --robot.calibration_dir={tmp_path}".split()
    teleop = f"--teleop.type=excavator_operator --teleop.calibration_dir={tmp_path} --teleop_time_s=0.1".split()
    config = draccus.parse(lerobot_teleoperate.TeleoperateConfig, args=[*robot, *teleop])
    with pytest.raises(ValueError, match=r"--fps=60 sends 60 actions a second.*Give --fps=10$"):
        make_robot_from_config(config.robot)


def test_a_replay_at_another_rate_than_that_of_the_recording_is_refused(tmp_path):
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta/info.json").write_text('{"fps": 25}')
    flags = ["--robot.type=excavator_sim", "--dataset.repo_id=a/b", f"--dataset.root={tmp_path}", "--dataset.episode=0"]
    for robot_fps in (10, 25):
        config = draccus.parse(lerobot_replay.ReplayConfig, args=[*flags, f"--robot.fps={robot_fps}"])
        if robot_fps == 25:
            require_fitting_command(config.robot)
        else:
            with pytest.raises(ConfigurationError, match=r"recorded at 25 frames a second.*Give --robot\.fps=25$"):
                require_fitting_command(config.robot)
    (tmp_path / "meta/info.json").write_text("{")
    require_fitting_command(config.robot)  # LeRobot says what is wrong with the dataset


def test_python_code_without_a_command_is_free():
    config = ExcavatorSimConfig()
    assert holder_of(config, "robot") is None
    holder = SimpleNamespace(robot=config, fps=30)
    assert holder_of(config, "robot") is None
    require_fitting_command(holder.robot)


@pytest.mark.parametrize(
    ("command", "operator"),
    [
        (SimpleNamespace(strategy=SimpleNamespace(type="episodic"), teleop=None), "policy"),
        (SimpleNamespace(strategy=SimpleNamespace(type="base"), teleop="joystick"), "policy"),
        (SimpleNamespace(teleop="joystick"), "person"),
        (SimpleNamespace(teleop=None), None),
        (None, None),
    ],
)
def test_a_rollout_is_a_policys_and_a_recording_with_a_teleoperator_a_persons(command, operator):
    assert operator_of(command) == operator
