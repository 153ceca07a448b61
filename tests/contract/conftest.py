"""Every simulated robot on a stand-in environment: instant, and its state tells what happened to it."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config

import lerobot_excav.plugin  # noqa: F401 - registers every --robot.type
from lerobot_excav.robots.simulated_robot import SimulatedRobot

ROBOT_TYPES = sorted(
    name for name, config in RobotConfig.get_known_choices().items() if config.__module__.startswith("lerobot_excav.")
)


class StandInEnv:
    """State: scene, target, number of steps since the reset."""

    def __init__(self, robot: SimulatedRobot) -> None:
        self._robot = robot
        self.is_closed = self.mask_missing = False
        self.actions: list[np.ndarray] = []

    def reset(self, *, options: dict[str, int]) -> tuple[dict[str, Any], dict[str, Any]]:
        self.state = np.zeros(len(self._robot.task_spec.state_names), np.float32)
        self.state[:2] = options["scene_id"], options["target_id"]
        self.target_id = options["target_id"]
        return self._observe(), self.info()

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self.state[2] += 1
        self.actions.append(action)
        return self._observe(), 0.0, False, False, self.info()

    def info(self) -> dict[str, Any]:
        return {"target_id": self.target_id, "mask_missing": self.mask_missing}

    def depth_m(self) -> np.ndarray:
        return np.ones(self._robot.settings.observation_size, np.float32)

    def close(self) -> None:
        self.is_closed = True

    def _observe(self) -> dict[str, Any]:
        config = self._robot.config
        picture = (config.observation_height, config.observation_width, 3)
        pixels = {camera: np.zeros(picture, np.uint8) for camera in self._robot.cameras}
        return {"agent_pos": self.state.copy(), "pixels": pixels}


@pytest.fixture(params=ROBOT_TYPES)
def robot_type(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def new_robot(robot_type: str, tmp_path: Path) -> Callable[..., SimulatedRobot]:
    """Make a robot that is not connected, on its own environment; settings go to its configuration."""

    def _new(**settings: Any) -> SimulatedRobot:
        settings = {"session_log": tmp_path / "session.jsonl", "calibration_dir": tmp_path, **settings}
        robot = make_robot_from_config(RobotConfig.get_choice_class(robot_type)(**settings))
        assert isinstance(robot, SimulatedRobot)
        return robot

    return _new


@pytest.fixture
def make_robot(
    new_robot: Callable[..., SimulatedRobot], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., SimulatedRobot]]:
    """Make a robot connected to a stand-in environment; settings go to its configuration."""
    robots = []

    def _make(**settings: Any) -> SimulatedRobot:
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
def still(new_robot: Callable[..., SimulatedRobot]) -> dict[str, float]:
    """Return an action well within the limits."""
    robot = new_robot()
    middle = 0.5 * (np.asarray(robot.task_spec.action_low) + np.asarray(robot.task_spec.action_high))
    values = np.broadcast_to(middle.astype(np.float32), (len(robot.task_spec.action_names),))
    return dict(zip(robot.task_spec.action_names, values.tolist(), strict=True))
