"""What every robot of this package does for LeRobot's commands, whatever machine it simulates."""

import logging
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import torch
from lerobot.rollout.robot_wrapper import ThreadSafeRobot
from lerobot.rollout.strategies.core import RolloutStrategy

from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.robots import live


def where(robot):
    """Return scene, target and number of steps, as the stand-in environment saw them."""
    observation = robot.get_observation()
    return tuple(int(observation[name]) for name in robot.task_spec.state_names[:3])


def test_features_are_known_before_connecting(new_robot):
    robot = new_robot(observation_height=64, observation_width=80)
    features, scalars = robot.observation_features, len(robot.task_spec.state_names)
    assert dict(list(features.items())[:scalars]) == dict.fromkeys(robot.task_spec.state_names, float)
    assert dict(list(features.items())[scalars:]) == dict.fromkeys(robot.cameras, (64, 80, 3))
    assert robot.action_features == dict.fromkeys(robot.task_spec.action_names, float)
    assert len(robot.cameras) == 3
    assert {"main", "target_mask"} < set(robot.cameras)
    # lerobot-rollout drops every scalar of another name.
    scalars = (*robot.task_spec.state_names, *robot.task_spec.action_names)
    assert all(name.endswith((".pos", ".vel")) for name in scalars)
    assert not robot.is_connected
    assert robot.is_calibrated


def test_observations_match_the_features(make_robot):
    robot = make_robot()
    observation = robot.get_observation()
    assert list(observation) == list(robot.observation_features)
    for name, feature in robot.observation_features.items():
        if feature is float:
            assert type(observation[name]) is float
        else:
            assert observation[name].shape == feature
            assert observation[name].dtype == np.uint8
    observation["main"][:] = 7  # does no harm
    assert not robot.get_observation()["main"].any()


def test_each_action_is_one_frame_and_is_clipped(make_robot, still):
    robot = make_robot()
    assert robot.send_action(still) == still
    sent = robot.send_action(dict.fromkeys(still, 1e6))
    assert where(robot) == (0, 0, 2)
    assert list(sent) == list(still)
    highest = np.broadcast_to(robot.task_spec.action_high, len(still))
    assert np.allclose(robot.env.actions[-1], highest)
    assert robot.env.actions[-1].dtype == np.float32
    assert list(sent.values()) == robot.env.actions[-1].tolist()
    # A recorded action comes as tensors of no dimension.
    robot.send_action({name: torch.tensor(value) for name, value in still.items()})
    assert robot.env.actions[-1].tolist() == list(still.values())


def test_an_action_that_is_incomplete_or_not_finite_is_refused(make_robot, still):
    robot = make_robot()
    *others, last = still
    not_finite = "is not finite; check the device or the policy"
    for action, message in (
        (still | {last: float("nan")}, not_finite),
        (still | {last: float("inf")}, not_finite),
        ({}, f"lacks {', '.join(still)}; it holds nothing"),
        (dict.fromkeys(others, 0.0) | {"odd": 0.0}, f"lacks {last}; it holds {', '.join(others)}"),
        ({"delta_x": 1.0}, "it holds delta_x"),
    ):
        with pytest.raises(DeviceError, match=message):
            robot.send_action(action)
    assert where(robot) == (0, 0, 0)


def test_connecting_and_disconnecting_free_the_simulation_and_say_so_out_of_turn(new_robot, make_robot, still):
    robot = new_robot()
    for use in (robot.get_observation, robot.disconnect, lambda: robot.send_action(still)):
        with pytest.raises(DeviceError, match=rf"{robot.name} is not connected; call connect\(\)"):
            use()
    robot = make_robot()
    with pytest.raises(DeviceError, match="connected already"):
        robot.connect()
    env = robot.env
    robot.disconnect()
    assert env.is_closed
    assert not robot.is_connected


def test_scenes_are_repeated_or_followed_target_by_target_and_each_start_is_an_episode(make_robot, still):
    robot = make_robot(scene_id=2, target_id=2)
    visited, episodes = [where(robot)], [robot.episode_count]
    for key in ("reinitialise", "next_scene", "next_scene", "next_scene"):
        robot.send_action(still)
        robot.send_action(still | {key: 1.0})
        visited.append(where(robot))
        episodes.append(robot.episode_count)
    assert visited == [(2, 2, 0), (2, 2, 0), (2, 3, 0), (3, 0, 0), (3, 1, 0)]
    assert np.diff(episodes).tolist() == [1] * 4


def test_a_rollout_can_drive_it_home(make_robot, caplog):
    robot = make_robot()
    positions = {name: value for name, value in robot.get_observation().items() if name.endswith(".pos")}
    hardware = SimpleNamespace(robot_wrapper=ThreadSafeRobot(robot), initial_position=positions)
    # LeRobot turns an error into a warning, and would leave the robot where it is.
    RolloutStrategy._return_to_initial_position(hardware, duration_s=0.06)
    assert "Could not return" not in caplog.text


def test_positions_alone_restart_the_scene_once_where_the_machine_takes_none(make_robot, still):
    robot = make_robot()
    home = {name: 0.0 for name in robot.task_spec.state_names if name.endswith(".pos")}
    takes_positions = set(home) <= set(still)
    resets = robot.episode_count
    for _ in range(2):
        robot.send_action(still)
        for _ in range(3):
            robot.send_action(home)
    assert robot.episode_count == resets + 2 * (not takes_positions)


def test_the_session_log_tells_settings_and_commands(make_robot, still, caplog):
    robot = make_robot(mask_noise="dilate", mask_noise_px=2, target_id=1)
    with caplog.at_level(logging.INFO):
        logging.info("Recording episode 0")  # as lerobot-record says when it begins
    for target_id in (1, 1, 3, 3):  # the fourth action is the first that follows the change
        robot.env.target_id = target_id
        robot.send_action(still)
    path = robot.config.session_log
    robot.disconnect()
    (episode,) = read_session(path).values()
    assert (episode.pair.target_id, episode.schedule) == (1, ((3, 3),))
    assert episode.task_settings == robot.settings
    assert (episode.env, episode.frames) == (robot.task_spec.env_type, 4)
    assert episode.simulation_version == robot.task_spec.simulation_version


def test_an_episode_that_waited_for_its_mask_is_marked(make_robot, still, caplog):
    robot = make_robot()
    with caplog.at_level(logging.INFO):
        logging.info("Recording episode 0")
    for held in (0, 3, 3):
        robot.env.held = held
        robot.send_action(still)
    path = robot.config.session_log
    robot.disconnect()
    assert read_session(path)[0].restarts == [2]


def test_a_robot_without_a_mask_is_not_driven(make_robot, still):
    robot = make_robot(target_id=1)
    robot.env.mask_missing = True
    for use in (lambda: robot.send_action(still), robot.start_scene):
        with pytest.raises(MaskMissingError, match="'oracle' finds nothing for target 1 of scene 0"):
            use()


def test_a_robot_that_finds_no_mask_at_first_stays_disconnected(make_robot, monkeypatch):
    robot = make_robot()
    robot.disconnect()
    with monkeypatch.context() as patched:
        patched.setattr(robot, "_require_mask", Mock(side_effect=MaskMissingError("nothing found")))
        with pytest.raises(MaskMissingError):
            robot.connect()
    assert not robot.is_connected
    robot.connect()
    assert robot.is_connected


def test_depth_is_offered_on_request_only(make_robot):
    assert make_robot(depth=True).depth_m().shape == (96, 128)
    with pytest.raises(DeviceError, match=r"--robot\.depth=true"):
        make_robot().depth_m()


def test_the_connected_robot_can_be_found(make_robot, robot_type):
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
        ("episode_length", 100, "--dataset.episode_time_s"),
        ("observation_height", 8, "32 to 1024"),
        ("scene_set", "exam", "train, val, test"),
        ("mask_condition", "wrong", "mismatched"),
        ("scene_id", -1, "from 0 on"),
        ("scene_id", 2**31, "from 0 to 2147483647"),
        ("target_id", 4, "0, 1, 2, 3"),
        ("advance", "never", "episode, button"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(new_robot, field, value, allowed):
    with pytest.raises(ConfigurationError) as raised:
        new_robot(**{field: value})
    assert f"robot.{field}={value!r}" in str(raised.value)
    assert allowed in str(raised.value)
