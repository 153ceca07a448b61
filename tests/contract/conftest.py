"""Every simulated robot on a stand-in environment: instant, and its state tells what happened to it."""

import logging

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config

import lerobot_excav.plugin  # noqa: F401 - registers every --robot.type
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig

ROBOTS = {
    name: config
    for name, config in RobotConfig.get_known_choices().items()
    if config.__module__.startswith("lerobot_excav.") and issubclass(config, SimulatedRobotConfig)
}


class StandInEnv:
    """State: scene, target, number of steps since the reset."""

    def __init__(self, robot):
        self._robot = robot
        self.is_closed = self.mask_missing = False
        self.held = 0
        self.actions = []

    def reset(self, *, options):
        self.state = np.zeros(len(self._robot.task_spec.state_names), np.float32)
        self.state[:2] = options["scene_id"], options["target_id"]
        self.target_id, self.options = options["target_id"], options
        return self._observe(), self.info()

    def step(self, action):
        self.state[2] += 1
        self.actions.append(action)
        return self._observe(), 0.0, False, False, self.info()

    def info(self):
        return {"target_id": self.target_id, "mask_missing": self.mask_missing, "mask_missing_frames": self.held}

    def depth_m(self):
        return np.ones(self._robot.settings.observation_size, np.float32)

    def close(self):
        self.is_closed = True

    def _observe(self):
        picture = np.zeros((*self._robot.settings.observation_size, 3), np.uint8)
        return {"agent_pos": self.state.copy(), "pixels": {camera: picture.copy() for camera in self._robot.cameras}}


@pytest.fixture(params=sorted(ROBOTS))
def robot_type(request):
    return request.param


@pytest.fixture
def new_robot(robot_type, tmp_path):
    """Make a robot that is not connected, on its own environment; settings go to its configuration."""

    def _new(**settings):
        common = {"session_log": tmp_path / "session.jsonl", "calibration_dir": tmp_path}
        return make_robot_from_config(ROBOTS[robot_type](**(common | settings)))

    return _new


@pytest.fixture
def make_robot(new_robot, monkeypatch):
    """Make a robot connected to a stand-in environment; settings go to its configuration."""
    robots = []

    def _make(**settings):
        robot = new_robot(**settings)
        monkeypatch.setattr(type(robot), "make_env", lambda self: StandInEnv(self))
        robot.connect()
        robots.append(robot)
        return robot

    yield _make
    for robot in robots:
        if robot.is_connected:
            robot.disconnect()


@pytest.fixture
def still(new_robot):
    """Return an action well within the limits."""
    spec = new_robot().task_spec
    middle = 0.5 * (np.asarray(spec.action_low) + np.asarray(spec.action_high))
    return dict(zip(spec.action_names, middle.astype(np.float32).tolist(), strict=True))


@pytest.fixture
def announcements_are_heard():
    """Set the root logger's level as LeRobot's commands do."""
    level = logging.getLogger().level
    logging.getLogger().setLevel(logging.NOTSET)
    yield
    logging.getLogger().setLevel(level)


@pytest.fixture
def record_episode(still, announcements_are_heard):
    """Play LeRobot's part of an episode; return its scene, target and steps before its first frame."""

    def _record(robot, index, *, frames=2):
        logging.info(f"Recording episode {index}")
        first = robot.get_observation()
        for _ in range(frames):
            robot.send_action(still)
        logging.info("Reset the environment")
        robot.send_action(still)
        return tuple(int(first[name]) for name in robot.task_spec.state_names[:3])

    return _record
