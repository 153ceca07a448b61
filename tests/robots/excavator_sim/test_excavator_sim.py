"""What only the simulated excavator does; what it shares with other robots is in tests/contract."""

import json
import logging
from collections.abc import Callable
from typing import Any

import pytest
from lerobot_excav.envs.tasks.scoop.simulation_version import SIMULATION_VERSION

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim

MakeRobot = Callable[..., ExcavatorSim]
STILL = dict.fromkeys(ACTION_NAMES, 0.0)


def where(robot: ExcavatorSim) -> tuple[int, ...]:
    """Return scene, target and number of steps, as the stand-in environment saw them."""
    observation = robot.get_observation()
    return tuple(int(observation[name]) for name in STATE_NAMES[:3])


def test_features_name_the_four_joints(tmp_path: Any) -> None:
    robot = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path))
    assert list(robot.observation_features) == [
        *("swing.pos", "boom.pos", "arm.pos", "bucket.pos"),
        *("swing.vel", "boom.vel", "arm.vel", "bucket.vel"),
        *("main", "cab", "target_mask"),
    ]
    assert list(robot.action_features) == ["swing.vel", "boom.vel", "arm.vel", "bucket.vel"]


def test_settings_reach_the_environment(make_robot: MakeRobot) -> None:
    robot = make_robot(fps=25, soil="gravel", fidelity="fine", scene_set="val", observation_height=64)
    settings = robot.env.settings  # type: ignore[attr-defined]
    assert (settings["fps"], settings["soil"], settings["scene_set"]) == (25, "gravel", "val")
    assert settings["fidelity"] == "fine"
    assert settings["observation_height"] == 64


def test_the_soil_is_in_the_session_log(make_robot: MakeRobot) -> None:
    robot = make_robot(soil="gravel", fidelity="fast")
    level = logging.getLogger().level
    logging.getLogger().setLevel(logging.NOTSET)  # as LeRobot's commands do
    logging.info("Recording episode 0")
    logging.getLogger().setLevel(level)
    robot.disconnect()
    assert robot.config.session_log is not None
    line = json.loads(robot.config.session_log.read_text())
    assert (line["task"], line["soil"], line["fidelity"]) == ("Scoop-v0", "gravel", "fast")
    assert line["simulation_version"] == SIMULATION_VERSION


def test_commands_are_clipped_to_one(make_robot: MakeRobot) -> None:
    robot = make_robot()
    assert robot.send_action(STILL | {"boom.vel": 3.0}) == STILL | {"boom.vel": 1.0}
    assert robot.get_observation()["boom.vel"] == 1.0


def test_depth_is_offered_on_request_only(tmp_path: Any, make_robot: MakeRobot) -> None:
    assert make_robot(depth=True).depth_m().shape == (96, 128)
    with pytest.raises(DeviceError, match=r"--robot\.depth=true"):
        make_robot().depth_m()
    with pytest.raises(DeviceError, match=r"call connect\(\)"):
        ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, depth=True)).depth_m()


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
