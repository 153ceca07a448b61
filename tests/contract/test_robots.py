"""What every robot of this package does for LeRobot's commands, whatever machine it simulates."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from lerobot.rollout.robot_wrapper import ThreadSafeRobot
from lerobot.rollout.strategies.core import RolloutStrategy

from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.robots import live
from lerobot_excav.robots.simulated_robot import SimulatedRobot

MakeRobot = Callable[..., SimulatedRobot[Any]]
Action = dict[str, float]


def where(robot: SimulatedRobot[Any]) -> tuple[int, ...]:
    """Return scene, target and number of steps, as the stand-in environment saw them."""
    observation = robot.get_observation()
    return tuple(int(observation[name]) for name in robot.state_names[:3])


def test_features_are_known_before_connecting(new_robot: MakeRobot) -> None:
    robot = new_robot(observation_height=64, observation_width=80)
    features, scalars = robot.observation_features, len(robot.state_names)
    assert dict(list(features.items())[:scalars]) == dict.fromkeys(robot.state_names, float)
    assert dict(list(features.items())[scalars:]) == dict.fromkeys(robot.cameras, (64, 80, 3))
    assert robot.action_features == dict.fromkeys(robot.action_names, float)
    assert len(robot.cameras) == 3
    assert {"main", "target_mask"} < set(robot.cameras)
    assert not robot.is_connected
    assert robot.is_calibrated


def test_rollout_keeps_every_scalar(new_robot: MakeRobot) -> None:
    robot = new_robot()
    assert all(name.endswith((".pos", ".vel")) for name in (*robot.state_names, *robot.action_names))


def test_observations_match_the_features(make_robot: MakeRobot) -> None:
    robot = make_robot()
    observation = robot.get_observation()
    assert list(observation) == list(robot.observation_features)
    for name, feature in robot.observation_features.items():
        if feature is float:
            assert type(observation[name]) is float
        else:
            assert observation[name].shape == feature
            assert observation[name].dtype == np.uint8


def test_an_observation_can_be_changed_without_harm(make_robot: MakeRobot) -> None:
    robot = make_robot()
    robot.get_observation()["main"][:] = 7
    assert not robot.get_observation()["main"].any()


def test_the_first_scene_and_target_are_the_configured_ones(make_robot: MakeRobot) -> None:
    assert where(make_robot(scene_id=5, target_id=2)) == (5, 2, 0)


def test_each_action_is_one_frame_and_is_clipped(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot()
    assert robot.send_action(still) == still
    sent = robot.send_action(dict.fromkeys(still, 1e6))
    assert where(robot) == (0, 0, 2)
    assert list(sent) == list(still)
    highest = np.broadcast_to(robot.action_high, len(still))
    assert np.allclose(robot.env.actions[-1], highest)
    assert robot.env.actions[-1].dtype == np.float32
    assert list(sent.values()) == robot.env.actions[-1].tolist()


def test_a_recorded_action_comes_as_tensors_of_no_dimension(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot()
    robot.send_action({name: torch.tensor(value) for name, value in still.items()})
    assert robot.env.actions[-1].tolist() == list(still.values())


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_an_action_that_is_not_finite_is_refused(make_robot: MakeRobot, still: Action, value: float) -> None:
    robot = make_robot()
    with pytest.raises(DeviceError, match="is not finite; check the device or the policy"):
        robot.send_action(still | {robot.action_names[2]: value})
    assert where(robot) == (0, 0, 0)


def test_an_incomplete_action_is_refused(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot()
    *others, last = still
    for action, message in (
        ({}, f"lacks {', '.join(still)}; it holds nothing"),
        (dict.fromkeys(others, 0.0) | {"odd": 0.0}, f"lacks {last}; it holds {', '.join(others)}"),
        ({"delta_x": 1.0}, "it holds delta_x"),
    ):
        with pytest.raises(DeviceError, match=message):
            robot.send_action(action)
    assert where(robot) == (0, 0, 0)


def test_a_robot_out_of_turn_says_so(new_robot: MakeRobot, make_robot: MakeRobot, still: Action) -> None:
    robot = new_robot()
    for use in (robot.get_observation, robot.disconnect, lambda: robot.send_action(still)):
        with pytest.raises(DeviceError, match=rf"{robot.name} is not connected; call connect\(\)"):
            use()
    with pytest.raises(DeviceError, match="connected already"):
        make_robot().connect()


def test_disconnecting_frees_the_simulation(make_robot: MakeRobot) -> None:
    robot = make_robot()
    env = robot.env
    robot.disconnect()
    assert env.is_closed
    assert not robot.is_connected


def test_reinitialise_starts_the_same_scene_again(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot(scene_id=2)
    robot.send_action(still)
    robot.send_action(still | {"reinitialise": 1.0})
    assert where(robot) == (2, 0, 0)


def test_next_scene_goes_through_the_targets_then_the_scenes(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot(scene_id=2, target_id=2)
    visited = []
    for _ in range(3):
        robot.send_action(still | {"next_scene": 1.0})
        visited.append(where(robot))
    assert visited == [(2, 3, 0), (3, 0, 0), (3, 1, 0)]


def test_every_restart_counts_as_an_episode(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot()
    episodes = [robot.episode_count]
    for key in ("reinitialise", "next_scene"):
        robot.send_action(still)
        robot.send_action(still | {key: 1.0})
        episodes.append(robot.episode_count)
    assert np.diff(episodes).tolist() == [1, 1]


def test_a_rollout_can_drive_it_home(make_robot: MakeRobot, caplog: pytest.LogCaptureFixture) -> None:
    robot = make_robot()
    positions = {name: value for name, value in robot.get_observation().items() if name.endswith(".pos")}
    hardware = SimpleNamespace(robot_wrapper=ThreadSafeRobot(robot), initial_position=positions)
    # LeRobot turns an error into a warning, and would leave the robot where it is.
    RolloutStrategy._return_to_initial_position(hardware, duration_s=0.06)
    assert "Could not return" not in caplog.text


def test_the_connected_robot_can_be_found(make_robot: MakeRobot, robot_type: str) -> None:
    with pytest.raises(DeviceError, match=f"0 robots of type {robot_type}.*--robot.type={robot_type}"):
        live.connected_robot(robot_type)
    robot = make_robot()
    assert live.connected_robot(robot_type) is robot
    with pytest.raises(DeviceError, match="0 robots of type another"):
        live.connected_robot("another")
    make_robot()
    with pytest.raises(DeviceError, match=f"2 robots of type {robot_type}"):
        live.connected_robot(robot_type)
    robot.disconnect()
    assert live.connected_robot(robot_type) is not robot


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("task", "Dance-v0", "-v0'"),
        ("fps", 30, "10, 25, 50"),
        ("observation_height", 8, "32 to 1024"),
        ("scene_set", "exam", "'train', 'val', 'test'"),
        ("scene_id", -1, "from 0"),
        ("target_id", 4, "0, 1, 2, 3"),
        ("advance", "never", "'episode', 'button'"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(
    new_robot: MakeRobot, field: str, value: object, allowed: str
) -> None:
    with pytest.raises(ConfigurationError) as raised:
        new_robot(**{field: value})
    assert f"robot.{field}={value!r}" in str(raised.value)
    assert allowed in str(raised.value)
