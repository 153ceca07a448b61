"""A simulated robot on a stand-in environment: instant, and its state tells what happened to it."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lerobot_excav.robots.excavator_sim import excavator_sim
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim


class StandInEnv:
    """State: scene, target, number of steps since the reset, and the last command."""

    def __init__(self, **settings: Any) -> None:
        self.settings = settings
        self.is_closed = False

    def reset(self, *, options: dict[str, int]) -> tuple[dict[str, Any], dict[str, Any]]:
        self.state = np.zeros(8, np.float32)
        self.state[:2] = options["scene_id"], options["target_id"]
        return self._observe(), {}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self.state[2] += 1
        self.state[4:] = action
        return self._observe(), 0.0, False, False, {}

    def depth_m(self) -> np.ndarray:
        return np.ones(self._size, np.float32)

    def close(self) -> None:
        self.is_closed = True

    @property
    def _size(self) -> tuple[int, int]:
        return self.settings["observation_height"], self.settings["observation_width"]

    def _observe(self) -> dict[str, Any]:
        pixels = {camera: np.zeros((*self._size, 3), np.uint8) for camera in ("main", "cab", "target_mask")}
        return {"agent_pos": self.state.copy(), "pixels": pixels}


@pytest.fixture
def make_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., ExcavatorSim]]:
    """Make a connected robot; settings go to its configuration."""
    monkeypatch.setattr(excavator_sim, "ExcavatorEnv", StandInEnv)
    robots = []

    def _make(**settings: Any) -> ExcavatorSim:
        settings = {"session_log": tmp_path / "session.jsonl", "calibration_dir": tmp_path, **settings}
        robots.append(ExcavatorSim(ExcavatorSimConfig(**settings)))
        robots[-1].connect()
        return robots[-1]

    yield _make
    for robot in robots:
        if robot.is_connected:
            robot.disconnect()
