"""What every simulated machine of this package shares as a LeRobot robot.

Every `send_action` advances the simulation by exactly one frame, 1/`fps` s, however long the command takes
in real time. So a recording is consistent at any speed, and sending its actions again from the same start
repeats its states bit for bit.

Every recorded episode starts from a fresh reset. With `advance=episode`, episode N of a dataset shows scene
`scene_id + (target_id + N) // 4` with target `(target_id + N) % 4`; recording it again repeats both, and
resuming a recording goes on where it stopped. Each press of `next_scene` leaves one target out, until the
robot disconnects.
"""

import logging
from abc import abstractmethod
from collections.abc import Mapping
from datetime import datetime
from typing import Any, ClassVar, Protocol, override

import numpy as np
from lerobot.robots import Robot
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig
from lerobot_excav.robots.recording_phases import RecordingPhases
from lerobot_excav.robots.session_log import SessionLog, default_path
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE, is_pressed

logger = logging.getLogger(__name__)


class SimulatedEnvironment(Protocol):
    """What a robot needs of the environment behind it."""

    def reset(self, *, options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start the scene and target that the options name."""

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one frame."""

    def close(self) -> None:
        """Free the simulation."""


class SimulatedRobot[Env: SimulatedEnvironment](Robot):  # type: ignore[misc]  # LeRobot's are untyped here
    """A machine in a simulated scene with one commanded target.

    Besides its commands an action may hold `reinitialise` or `next_scene`; a value above 0.5 restarts the
    scene or moves on instead of advancing the simulation.

    Attributes:
        state_names: Names of the entries of `agent_pos`.
        action_names: Names of the entries of the environment's action.
        camera_names: Names of the pictures.
        action_low: Least value of each command, (actions,) or one for all.
        action_high: Greatest value of each command, (actions,) or one for all.
        simulation_version: Version of the simulation, for session logs.
        session_folder: Where session logs are put by default, below `outputs`.
        cameras: The cameras by name, with the shape (H, W, 3) of their pictures.
        episode_count: Number of resets so far; changes exactly when an episode starts.
    """

    state_names: ClassVar[tuple[str, ...]]
    action_names: ClassVar[tuple[str, ...]]
    camera_names: ClassVar[tuple[str, ...]]
    action_low: ClassVar[float | NDArray[np.float64]]
    action_high: ClassVar[float | NDArray[np.float64]]
    simulation_version: ClassVar[int]
    session_folder: ClassVar[str]

    def __init__(self, config: SimulatedRobotConfig) -> None:
        super().__init__(config)
        self.config = config
        shape = (config.observation_height, config.observation_width, 3)
        self.cameras = dict.fromkeys(self.camera_names, shape)
        self.episode_count = 0
        self._env: Env | None = None
        self._observation: dict[str, Any] = {}
        self._first = config.scene_id * TARGETS_PER_SCENE + config.target_id
        self._skipped = 0
        self._number = self._first  # counts targets over all scenes
        log_path = config.session_log or default_path(self.session_folder, datetime.now())
        self._log = SessionLog(log_path, {**self._describe_session(), **self.describe_simulation()})
        self._phases = RecordingPhases(
            on_episode=self._begin_episode,
            on_pause=self._log.pause,
            on_discard=self._log.discard,
            on_stop=self._log.write,
        )

    @abstractmethod
    def make_env(self) -> Env:
        """Make the environment that the configuration describes, without an end to its episodes."""

    @abstractmethod
    def describe_simulation(self) -> dict[str, Any]:
        """Return what a session line needs to name the environment, besides what all robots share."""

    @property
    def observation_features(self) -> dict[str, type | tuple[int, int, int]]:
        """Scalars in the order of `agent_pos`, and the cameras."""
        return {**dict.fromkeys(self.state_names, float), **self.cameras}

    @property
    def action_features(self) -> dict[str, type]:
        """Commands in the order of the environment's action."""
        return dict.fromkeys(self.action_names, float)

    @property
    def env(self) -> Env:
        """The environment behind the robot.

        Raises:
            DeviceError: The robot is not connected.
        """
        if self._env is None:
            raise DeviceError(f"the robot {self.name} is not connected; call connect() first.")
        return self._env

    @property
    def scene_id(self) -> int:
        """Current scene."""
        return self._number // TARGETS_PER_SCENE

    @property
    def target_id(self) -> int:
        """Current target of the scene."""
        return self._number % TARGETS_PER_SCENE

    @property
    def is_connected(self) -> bool:
        """Whether the simulation runs."""
        return self._env is not None

    @property
    def is_calibrated(self) -> bool:
        """Always: a simulation needs no calibration."""
        return True

    def calibrate(self) -> None:
        """Do nothing: a simulation needs no calibration."""

    def configure(self) -> None:
        """Do nothing: the configuration is complete when the robot is made."""

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Start the simulation at the first scene and target.

        Raises:
            DeviceError: The robot is connected already.
        """
        if self._env is not None:
            raise DeviceError(f"the robot {self.name} is connected already; call disconnect() first.")
        self._env = self.make_env()
        self._number, self._skipped = self._first, 0
        self.start_scene()
        self._phases.attach()
        live.announce(self)

    def disconnect(self) -> None:
        """Stop the simulation and complete the session log.

        Raises:
            DeviceError: The robot is not connected.
        """
        env = self.env
        self._env = None
        live.retract(self)
        self._phases.detach()
        env.close()
        self._log.write()

    def get_observation(self) -> dict[str, Any]:
        """Return the current state and pictures; a second call without an action returns the same.

        Raises:
            DeviceError: The robot is not connected.
        """
        _ = self.env
        state = self._observation["agent_pos"].tolist()
        pixels = self._observation["pixels"]
        return {
            **dict(zip(self.state_names, state, strict=True)),
            **{camera: pixels[camera].copy() for camera in self.camera_names},
        }

    def send_action(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Advance the simulation by one frame, or restart it; see the class.

        Args:
            action: Every command of `action_features`: numbers or tensors of one element.

        Returns:
            The commands carried out, clipped to their limits; the action as it came if it restarted the scene.

        Raises:
            DeviceError: The robot is not connected, a command is missing or not finite.
        """
        env = self.env
        if is_pressed(action, NEXT_SCENE):
            self._number += 1
            self._skipped += 1
            self.restart_scene()
            return dict(action)
        if is_pressed(action, REINITIALISE):
            self.restart_scene()
            return dict(action)
        command = np.clip(command_from_action(action, self.action_names), self.action_low, self.action_high)
        command = command.astype(np.float32)
        self._observation = env.step(command)[0]
        self._log.count_frame()
        return dict(zip(self.action_names, command.tolist(), strict=True))

    def restart_scene(self) -> None:
        """Start the current scene again; within a recorded episode the session log notes it."""
        self._log.note_restart()
        self.start_scene()

    def start_scene(self) -> None:
        """Reset the environment to the current scene and target."""
        options = {"scene_id": self.scene_id, "target_id": self.target_id}
        self._observation, _ = self.env.reset(options=options)
        self.episode_count += 1
        logger.info("Scene %d, target %d of set %s", self.scene_id, self.target_id, self.config.scene_set)

    def _begin_episode(self, episode_index: int) -> None:
        if self.config.advance == "episode":
            self._number = self._first + self._skipped + episode_index
        self.start_scene()
        self._log.begin(episode_index, scene_id=self.scene_id, target_id=self.target_id)

    def _describe_session(self) -> dict[str, Any]:
        return {
            "simulation_version": self.simulation_version,
            "scene_set": self.config.scene_set,
            "fps": self.config.fps,
            "observation_height": self.config.observation_height,
            "observation_width": self.config.observation_width,
            "task": self.config.task,
        }


def command_from_action(action: Mapping[str, Any], names: tuple[str, ...]) -> NDArray[np.float32]:
    """Take the commands out of LeRobot's dictionary.

    Args:
        action: Numbers or tensors of one element by name.
        names: Names of the commands, in their order.

    Returns:
        The commands, shape (names,), float32.

    Raises:
        DeviceError: A command is missing, not a number or not finite.
    """
    missing = [name for name in names if name not in action]
    if missing:
        raise DeviceError(
            f"the action lacks {', '.join(missing)}; it holds {', '.join(action) or 'nothing'}. "
            f"Use a teleoperator or a dataset with the actions {', '.join(names)}."
        )
    command = np.array([float(action[name]) for name in names], dtype=np.float32)
    if not np.isfinite(command).all():
        raise DeviceError(
            f"the action {dict(zip(names, command.tolist(), strict=True))} is not finite; "
            "check the device or the policy that sent it."
        )
    return command
