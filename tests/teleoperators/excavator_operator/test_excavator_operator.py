"""The scripted operator drives the connected robot, and starts over with every scene."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from lerobot_excav.envs.excavator.env import ExcavatorEnv
from lerobot_excav.envs.excavator.operator import ScriptedOperator
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_operator.excavator_operator import ExcavatorOperator

Action = dict[str, float]


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[ExcavatorSim]:
    size = {"observation_height": 32, "observation_width": 32}
    robot = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, scene_id=1, target_id=2, **size))
    yield robot
    if robot.is_connected:
        robot.disconnect()


@pytest.fixture
def make_operator(tmp_path: Path) -> Callable[..., ExcavatorOperator]:
    def _make(seed: int = 0) -> ExcavatorOperator:
        operator = ExcavatorOperator(ExcavatorOperatorConfig(calibration_dir=tmp_path, seed=seed))
        operator.connect()
        return operator

    return _make


def drive(robot: ExcavatorSim, operator: ExcavatorOperator, frames: int = 25) -> list[Action]:
    actions = []
    for _ in range(frames):
        actions.append(operator.get_action())
        robot.send_action(actions[-1])
    return actions


def test_it_acts_as_the_scripted_operator_in_the_environment(
    robot: ExcavatorSim, make_operator: Callable[..., ExcavatorOperator]
) -> None:
    operator = make_operator(seed=3)  # connected before the robot, as lerobot-record does
    robot.connect()
    driven = [list(action.values()) for action in drive(robot, operator)]
    env = ExcavatorEnv(obs_type="agent_pos")
    env.reset(options={"scene_id": 1, "target_id": 2})
    script = ScriptedOperator(rng=np.random.default_rng((3, 1, 2)))
    script.reset(env)
    expected = []
    for _ in range(25):
        expected.append(script.act(env).tolist())
        env.step(np.array(expected[-1], np.float32))
    assert driven == expected
    assert np.abs(driven).max() > 0.1


def test_a_restarted_scene_is_dug_again_in_the_same_way(
    robot: ExcavatorSim, make_operator: Callable[..., ExcavatorOperator]
) -> None:
    robot.connect()
    operator = make_operator()
    first = drive(robot, operator)
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, operator) == first
    robot.send_action(first[-1] | {"next_scene": 1.0})
    assert drive(robot, operator) != first


def test_the_seed_changes_the_demonstration(
    robot: ExcavatorSim, make_operator: Callable[..., ExcavatorOperator]
) -> None:
    robot.connect()
    first = drive(robot, make_operator(seed=0))
    robot.send_action(first[-1] | {"reinitialise": 1.0})
    assert drive(robot, make_operator(seed=1)) != first


def test_actions_have_the_robots_names(
    robot: ExcavatorSim, make_operator: Callable[..., ExcavatorOperator]
) -> None:
    operator = make_operator()
    assert operator.action_features == robot.action_features
    assert operator.feedback_features == {}
    robot.connect()
    assert list(operator.get_action()) == list(robot.action_features)


def test_without_a_simulated_robot_it_says_what_to_do(
    make_operator: Callable[..., ExcavatorOperator],
) -> None:
    operator = make_operator()
    with pytest.raises(DeviceError, match=r"--robot\.type=excavator_sim"):
        operator.get_action()
    operator.disconnect()
    with pytest.raises(DeviceError, match=r"call connect\(\)"):
        operator.get_action()


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"teleop\.seed=-1"):
        ExcavatorOperatorConfig(seed=-1)
