"""The robot does what LeRobot's commands expect of one, and starts scenes when asked to."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from lerobot_excav.envs.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim

MakeRobot = Callable[..., ExcavatorSim]
STILL = dict.fromkeys(ACTION_NAMES, 0.0)


def where(robot: ExcavatorSim) -> tuple[int, int, int]:
    """Return scene, target and number of steps, as the stand-in environment saw them."""
    observation = robot.get_observation()
    return tuple(int(observation[name]) for name in STATE_NAMES[:3])  # type: ignore[return-value]


def test_features_are_known_before_connecting(tmp_path: Any) -> None:
    robot = ExcavatorSim(
        ExcavatorSimConfig(observation_height=64, observation_width=80, calibration_dir=tmp_path)
    )
    features = robot.observation_features
    assert list(features)[:8] == [
        *("swing.pos", "boom.pos", "arm.pos", "bucket.pos"),
        *("swing.vel", "boom.vel", "arm.vel", "bucket.vel"),
    ]
    assert {name: features[name] for name in list(features)[8:]} == dict.fromkeys(robot.cameras, (64, 80, 3))
    assert robot.action_features == dict.fromkeys(("swing.vel", "boom.vel", "arm.vel", "bucket.vel"), float)
    assert len(robot.cameras) == 3
    assert not robot.is_connected
    assert robot.is_calibrated


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


def test_settings_reach_the_environment(make_robot: MakeRobot) -> None:
    robot = make_robot(fps=25, soil="gravel", fidelity="fine", scene_set="val", observation_height=64)
    settings = robot.env.settings  # type: ignore[attr-defined]
    assert (settings["fps"], settings["soil"], settings["scene_set"]) == (25, "gravel", "val")
    assert settings["fidelity"] == "fine"
    assert settings["observation_height"] == 64


def test_the_first_scene_and_target_are_the_configured_ones(make_robot: MakeRobot) -> None:
    assert where(make_robot(scene_id=5, target_id=2)) == (5, 2, 0)


def test_each_action_is_one_frame_and_is_clipped(make_robot: MakeRobot) -> None:
    robot = make_robot()
    sent = robot.send_action(STILL | {"boom.vel": 3.0})
    assert where(robot) == (0, 0, 1)
    assert sent == STILL | {"boom.vel": 1.0}
    assert robot.get_observation()["boom.vel"] == 1.0


def test_a_recorded_action_comes_as_tensors_of_no_dimension(make_robot: MakeRobot) -> None:
    robot = make_robot()
    robot.send_action({name: torch.tensor(0.25) for name in ACTION_NAMES})
    assert robot.get_observation()["arm.vel"] == 0.25


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ({}, "lacks swing.vel, boom.vel, arm.vel, bucket.vel; it holds nothing"),
        ({"swing.vel": 0.0, "boom.vel": 0.0, "arm.vel": 0.0}, "lacks bucket.vel"),
        ({"delta_x": 1.0}, "it holds delta_x"),
        (STILL | {"arm.vel": float("nan")}, "is not finite"),
        (STILL | {"arm.vel": float("inf")}, "is not finite"),
    ],
)
def test_an_unusable_action_is_refused(make_robot: MakeRobot, action: dict[str, float], message: str) -> None:
    robot = make_robot()
    with pytest.raises(DeviceError, match=message):
        robot.send_action(action)
    assert where(robot) == (0, 0, 0)


def test_a_robot_out_of_turn_says_so(tmp_path: Any, make_robot: MakeRobot) -> None:
    robot = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, depth=True))
    for use in (robot.get_observation, robot.disconnect, robot.depth_m, lambda: robot.send_action(STILL)):
        with pytest.raises(DeviceError, match=r"not connected; call connect\(\)"):
            use()
    connected = make_robot()
    with pytest.raises(DeviceError, match="connected already"):
        connected.connect()


def test_disconnecting_frees_the_simulation(make_robot: MakeRobot) -> None:
    robot = make_robot()
    env = robot.env
    robot.disconnect()
    assert env.is_closed  # type: ignore[attr-defined]
    assert not robot.is_connected


def test_depth_is_offered_on_request_only(make_robot: MakeRobot) -> None:
    assert make_robot(depth=True).depth_m().shape == (96, 128)
    with pytest.raises(DeviceError, match=r"--robot\.depth=true"):
        make_robot().depth_m()


def test_reinitialise_starts_the_same_scene_again(make_robot: MakeRobot) -> None:
    robot = make_robot(scene_id=2)
    robot.send_action(STILL)
    robot.send_action(STILL | {"reinitialise": 1.0})
    assert where(robot) == (2, 0, 0)


def test_next_scene_goes_through_the_targets_then_the_scenes(make_robot: MakeRobot) -> None:
    robot = make_robot(scene_id=2, target_id=2)
    visited = []
    for _ in range(3):
        robot.send_action(STILL | {"next_scene": 1.0})
        visited.append(where(robot))
    assert visited == [(2, 3, 0), (3, 0, 0), (3, 1, 0)]


def test_being_driven_home_restarts_the_scene_once(make_robot: MakeRobot) -> None:
    robot = make_robot()
    robot.send_action(STILL)
    resets = robot.episode_count
    for _ in range(3):
        robot.send_action({"swing.pos": 0.1, "boom.pos": 0.2})
    assert where(robot) == (0, 0, 0)
    assert robot.episode_count == resets + 1
    robot.send_action(STILL)
    robot.send_action({"swing.pos": 0.1})
    assert robot.episode_count == resets + 2


def test_the_connected_robot_can_be_found(make_robot: MakeRobot) -> None:
    with pytest.raises(DeviceError, match="0 robots of type excavator_sim"):
        live.connected_robot("excavator_sim")
    robot = make_robot()
    assert live.connected_robot("excavator_sim") is robot
    make_robot()
    with pytest.raises(DeviceError, match="2 robots of type excavator_sim"):
        live.connected_robot("excavator_sim")
    robot.disconnect()
    assert live.connected_robot("excavator_sim") is not robot
