"""What every teleoperator of this package does for LeRobot's commands, and every scripted operator for its robot."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import make_teleoperator_from_config
from lerobot.teleoperators.config import TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401 - registers every --teleop.type
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.robots.simulated_robot import SimulatedRobot
from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig
from lerobot_excav.teleoperators.scripted_teleoperator import ScriptedTeleoperator

CONFIGS = {
    name: config
    for name, config in TeleoperatorConfig.get_known_choices().items()
    if config.__module__.startswith("lerobot_excav.")
}
SCRIPTED = sorted(name for name, config in CONFIGS.items() if issubclass(config, ScriptedTeleoperatorConfig))
FRAMES = 25

MakeOperator = Callable[..., ScriptedTeleoperator]
Action = dict[str, float]


def actions_of_robots(calibration_dir: Path) -> list[list[str]]:
    """Return the names of the actions of every registered robot."""
    robots = [
        make_robot_from_config(config(calibration_dir=calibration_dir))
        for config in RobotConfig.get_known_choices().values()
        if config.__module__.startswith("lerobot_excav.")
    ]
    return [list(robot.action_features) for robot in robots]


@pytest.mark.parametrize("name", sorted(CONFIGS))
def test_its_actions_are_those_of_a_robot(name: str, tmp_path: Path) -> None:
    teleoperator = make_teleoperator_from_config(CONFIGS[name](calibration_dir=tmp_path))
    assert list(teleoperator.action_features) in actions_of_robots(tmp_path)
    assert set(teleoperator.action_features.values()) == {float}


@pytest.mark.parametrize("name", sorted(CONFIGS))
def test_it_needs_neither_calibration_nor_feedback(name: str, tmp_path: Path) -> None:
    teleoperator = make_teleoperator_from_config(CONFIGS[name](calibration_dir=tmp_path))
    teleoperator.calibrate()
    teleoperator.configure()
    teleoperator.send_feedback({})
    assert teleoperator.is_calibrated
    assert teleoperator.feedback_features == {}
    assert not teleoperator.is_connected


@pytest.fixture(params=SCRIPTED)
def make_operator(request: pytest.FixtureRequest, tmp_path: Path) -> MakeOperator:
    """Make a connected scripted operator."""

    def _make(seed: int = 0) -> ScriptedTeleoperator:
        config = CONFIGS[request.param](calibration_dir=tmp_path, seed=seed)
        operator = make_teleoperator_from_config(config)
        assert isinstance(operator, ScriptedTeleoperator)
        operator.connect()
        return operator

    return _make


@pytest.fixture
def robot(make_operator: MakeOperator, tmp_path: Path) -> Iterator[SimulatedRobot]:
    """Make the robot that the operator drives, not connected."""
    settings = {"observation_height": 32, "observation_width": 32, "scene_id": 1, "target_id": 2}
    config = RobotConfig.get_choice_class(make_operator().robot_type)(calibration_dir=tmp_path, **settings)
    robot = make_robot_from_config(config)
    assert isinstance(robot, SimulatedRobot)
    yield robot
    if robot.is_connected:
        robot.disconnect()


def drive(robot: SimulatedRobot, operator: ScriptedTeleoperator) -> list[Action]:
    actions = []
    for _ in range(FRAMES):
        actions.append(operator.get_action())
        robot.send_action(actions[-1])
    return actions


def test_a_restarted_scene_is_demonstrated_again_in_the_same_way(
    robot: SimulatedRobot, make_operator: MakeOperator
) -> None:
    operator = make_operator()  # connected before the robot, as lerobot-record does
    robot.connect()
    first = drive(robot, operator)
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, operator) == first
    robot.send_action(first[-1] | {"next_scene": 1.0})
    assert drive(robot, operator) != first


def test_the_seed_changes_the_demonstration(robot: SimulatedRobot, make_operator: MakeOperator) -> None:
    robot.connect()
    first = drive(robot, make_operator(seed=0))
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, make_operator(seed=1)) != first


def test_what_it_records_is_what_the_robot_carries_out(robot: SimulatedRobot, make_operator: MakeOperator) -> None:
    robot.connect()
    operator = make_operator()
    action = operator.get_action()
    assert list(action) == list(robot.action_features)
    assert list(robot.send_action(action).values()) == np.float32(list(action.values())).tolist()


def test_without_its_robot_it_says_what_to_do(make_operator: MakeOperator) -> None:
    operator = make_operator()
    with pytest.raises(DeviceError, match=rf"--robot\.type={operator.robot_type}"):
        operator.get_action()
    operator.disconnect()
    with pytest.raises(DeviceError, match=r"call connect\(\)"):
        operator.get_action()


@pytest.mark.parametrize("name", SCRIPTED)
def test_a_negative_seed_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=r"teleop\.seed=-1"):
        CONFIGS[name](seed=-1)
