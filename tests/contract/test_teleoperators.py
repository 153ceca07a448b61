"""What every teleoperator of this package does for LeRobot's commands, and every scripted operator for its robot."""

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import make_teleoperator_from_config
from lerobot.teleoperators.config import TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401 - registers every --teleop.type
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig

CONFIGS = {
    name: config
    for name, config in TeleoperatorConfig.get_known_choices().items()
    if config.__module__.startswith("lerobot_excav.")
}
SCRIPTED = sorted(name for name, config in CONFIGS.items() if issubclass(config, ScriptedTeleoperatorConfig))
FRAMES = 25


@pytest.mark.parametrize("name", sorted(CONFIGS))
def test_it_acts_as_a_robot_does_and_needs_neither_calibration_nor_feedback(name, tmp_path):
    teleoperator = make_teleoperator_from_config(CONFIGS[name](calibration_dir=tmp_path))
    robots = [
        make_robot_from_config(config(calibration_dir=tmp_path))
        for config in RobotConfig.get_known_choices().values()
        if config.__module__.startswith("lerobot_excav.")
    ]
    assert teleoperator.action_features in [robot.action_features for robot in robots]
    teleoperator.calibrate()
    teleoperator.configure()
    teleoperator.send_feedback({})
    assert teleoperator.is_calibrated
    assert teleoperator.feedback_features == {}
    assert not teleoperator.is_connected


@pytest.fixture(params=SCRIPTED)
def make_operator(request, tmp_path):
    """Make a connected scripted operator."""

    def _make(seed=0):
        operator = make_teleoperator_from_config(CONFIGS[request.param](calibration_dir=tmp_path, seed=seed))
        operator.connect()
        return operator

    return _make


@pytest.fixture
def robot(make_operator, tmp_path):
    """Make the robot that the operator drives, not connected."""
    settings = {"observation_height": 32, "observation_width": 32, "scene_id": 1, "target_id": 2}
    config = RobotConfig.get_choice_class(make_operator().robot_type)(calibration_dir=tmp_path, **settings)
    robot = make_robot_from_config(config)
    yield robot
    if robot.is_connected:
        robot.disconnect()


def drive(robot, operator):
    actions = []
    for _ in range(FRAMES):
        actions.append(operator.get_action())
        robot.send_action(actions[-1])
    return actions


def test_scene_and_seed_decide_the_demonstration(robot, make_operator):
    operator = make_operator()  # connected before the robot, as lerobot-record does
    robot.connect()
    first = drive(robot, operator)
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, operator) == first
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, make_operator(seed=1)) != first
    robot.send_action(first[-1] | {"next_scene": 1.0})
    assert drive(robot, operator) != first


def test_the_session_log_says_that_it_drives(robot, make_operator, monkeypatch):
    noted = []
    robot.connect()
    monkeypatch.setattr(robot, "note_operator", noted.append)
    make_operator().get_action()
    assert noted == ["scripted"]


def test_what_it_records_is_what_the_robot_carries_out(robot, make_operator):
    robot.connect()
    operator = make_operator()
    action = operator.get_action()
    assert list(action) == list(robot.action_features)
    assert list(robot.send_action(action).values()) == np.float32(list(action.values())).tolist()


def test_without_its_robot_or_with_a_negative_seed_it_says_what_to_do(make_operator):
    operator = make_operator()
    with pytest.raises(DeviceError, match=rf"--robot\.type={operator.robot_type}"):
        operator.get_action()
    operator.disconnect()
    with pytest.raises(DeviceError, match=r"call connect\(\)"):
        operator.get_action()
    with pytest.raises(ConfigurationError, match=r"teleop\.seed=-1"):
        make_operator(seed=-1)
