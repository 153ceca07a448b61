"""A tiny environment with the interface of the real ones, and datasets made with it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations

# How long an example takes says how busy the machine is, not whether the code is right.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

FRAMES = 6


class ToyEnv:
    """Joints follow the action; an episode succeeds unless it is scene 3 with target 1."""

    task_description = "Dig where the mask points."

    def __init__(self, settings: DemonstrationSettings, noise: float = 0.0) -> None:
        self.settings, self.noise = settings, noise
        self.names = settings.environment
        self.joints = len(self.names.action_names)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        self.scene_id, self.target_id = options["scene_id"], options["target_id"]
        rng = np.random.default_rng(self.scene_id)
        self.joint_pos = rng.uniform(-1, 1, self.joints)
        self.view = rng.integers(0, 256, (self.settings.height, self.settings.width, 3), dtype=np.uint8)
        self.joint_vel = np.zeros(self.joints)
        self.frame = 0
        return self._observe(), self._info()

    def step(self, action: np.ndarray) -> Any:
        assert action.dtype == np.float32
        self.joint_vel = action.astype(float) * (1 + self.noise)
        self.joint_pos = self.joint_pos + self.joint_vel / self.settings.fps
        self.frame += 1
        truncated = self.frame >= min(self.settings.episode_length, FRAMES)
        info = self._info()
        if truncated:
            info["episode_metrics"] = {"retained_mass_kg": 100.0 * self.frame}
        return self._observe(), 0.0, False, truncated, info

    def close(self) -> None:
        pass

    def _observe(self) -> dict[str, Any]:
        mask = np.zeros_like(self.view)
        mask[4 + 4 * self.target_id :][:4, 8:16] = 255
        main = self.view.copy()
        main[0, 0] = self.frame
        state = np.concatenate([self.joint_pos, self.joint_vel]).astype(np.float32)
        _, second, _ = self.names.cameras
        return {
            "agent_pos": state[: len(self.names.state_names)],
            "pixels": {"main": main, second: self.view[::-1].copy(), "target_mask": mask},
        }

    def _info(self) -> dict[str, Any]:
        done = self.frame >= min(self.settings.episode_length, FRAMES)
        failing = self.scene_id == 3 and self.target_id == 1
        state = np.zeros(len(self.names.task_state_names), dtype=np.float32)
        state[:3] = 5, 50 * self.frame, 100 * self.frame
        return {"is_success": done and not failing, "task_state": state}


class ToyOperator:
    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def reset(self, env: Any) -> None:
        pass

    def act(self, env: Any) -> np.ndarray:
        low, high = env.settings.environment.action_limits
        return self.rng.uniform(low, high).astype(np.float32)


@dataclass(frozen=True)
class ToyRig:
    noise: float = 0.0

    def environment(self, settings: DemonstrationSettings) -> ToyEnv:
        return ToyEnv(settings, self.noise)

    def operator(self, rng: np.random.Generator) -> ToyOperator:
        return ToyOperator(rng)


@pytest.fixture(scope="session")
def toy_rig() -> type[ToyRig]:
    return ToyRig


@pytest.fixture(scope="session")
def toy_settings() -> Any:
    """Make settings of small pictures; keywords change them."""

    def make(**changes: Any) -> DemonstrationSettings:
        return DemonstrationSettings.of(
            **{"env": "excavator", "scenes": 3, "height": 32, "width": 48, **changes}
        )

    return make


@pytest.fixture(scope="session")
def record_toy(toy_settings: Any) -> Any:
    """Record a dataset of the toy environment in this process."""

    def record(out: Path, *, resume: bool = False, rig: ToyRig | None = None, **changes: Any) -> Any:
        settings = toy_settings(**changes)
        return record_demonstrations(
            settings, out, workers=0, resume=resume, rig=rig or ToyRig(), show_progress=False
        )

    return record


@pytest.fixture(scope="session")
def arm_dataset(tmp_path_factory: pytest.TempPathFactory, record_toy: Any) -> Path:
    """Two scenes of the arm with four targets each, pictures as video. Not to be changed by tests."""
    out = tmp_path_factory.mktemp("arm") / "dataset"
    record_toy(out, env="fr5_grasp", scenes=2)
    return out


@pytest.fixture(scope="session")
def paired_dataset(tmp_path_factory: pytest.TempPathFactory, record_toy: Any) -> Path:
    """Five scenes with four targets each, except scene 3, which lacks target 1. Not to be changed by tests."""
    out = tmp_path_factory.mktemp("paired") / "dataset"
    record_toy(out, scenes=5)
    return out
