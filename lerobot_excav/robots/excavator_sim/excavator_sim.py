"""The simulated excavator as a LeRobot robot.

Every `send_action` advances the simulation by exactly one frame, 1/`fps` s, however long the command takes
in real time. So a recording is consistent at any speed, and sending its actions again from the same start
repeats its states bit for bit.

Every recorded episode starts from a fresh reset. With `advance=episode`, episode N of a dataset shows scene
`scene_id + (target_id + N) // 4` with target `(target_id + N) % 4`; recording it again repeats both, and
resuming a recording goes on where it stopped. Each press of `next_scene` leaves one target out, until the
robot disconnects.
"""

import logging
from collections.abc import Mapping
from datetime import datetime
from typing import Any, override

import numpy as np
from lerobot.robots import Robot
from numpy.typing import NDArray

from lerobot_excav.envs.excavator.env import ExcavatorEnv
from lerobot_excav.envs.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.settings import TARGETS_PER_SCENE
from lerobot_excav.envs.simulation_version import SIMULATION_VERSION
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.features import NEXT_SCENE, REINITIALISE
from lerobot_excav.robots.excavator_sim.recording_phases import RecordingPhases
from lerobot_excav.robots.excavator_sim.session_log import SessionLog, default_path

logger = logging.getLogger(__name__)

_ENDLESS = 2**31 - 1  # frames; LeRobot's commands, not the environment, end an episode


class ExcavatorSim(Robot):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """An excavator in front of a pile, driven by `swing.vel`, `boom.vel`, `arm.vel` and `bucket.vel`.

    Besides these commands an action may hold `reinitialise` or `next_scene`; a value above 0.5 restarts the
    scene or moves on instead of advancing the simulation. An action with positions only, such as
    `lerobot-rollout` sends between episodes to drive a robot home, restarts the scene once.

    Attributes:
        cameras: The cameras by name, with the shape (H, W, 3) of their pictures.
        episode_count: Number of resets so far; changes exactly when an episode starts.
    """

    config_class = ExcavatorSimConfig
    name = "excavator_sim"

    def __init__(self, config: ExcavatorSimConfig) -> None:
        super().__init__(config)
        self.config = config
        shape = (config.observation_height, config.observation_width, 3)
        self.cameras = dict.fromkeys(CAMERAS, shape)
        self.episode_count = 0
        self._env: ExcavatorEnv | None = None
        self._observation: dict[str, Any] = {}
        self._first = config.scene_id * TARGETS_PER_SCENE + config.target_id
        self._skipped = 0
        self._number = self._first  # counts targets over all scenes
        self._is_homing = False
        self._log = SessionLog(config.session_log or default_path(datetime.now()), self._describe())
        self._phases = RecordingPhases(
            on_episode=self._begin_episode,
            on_pause=self._log.pause,
            on_discard=self._log.discard,
            on_stop=self._log.write,
        )

    @property
    def observation_features(self) -> dict[str, type | tuple[int, int, int]]:
        """Joint positions [rad] and velocities [rad/s] in the order of `agent_pos`, and three cameras."""
        return {**dict.fromkeys(STATE_NAMES, float), **self.cameras}

    @property
    def action_features(self) -> dict[str, type]:
        """Joystick commands in [-1, 1]."""
        return dict.fromkeys(ACTION_NAMES, float)

    @property
    def env(self) -> ExcavatorEnv:
        """The environment behind the robot.

        Raises:
            DeviceError: The robot is not connected.
        """
        if self._env is None:
            raise DeviceError("the simulated excavator is not connected; call connect() first.")
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
            raise DeviceError("the simulated excavator is connected already; call disconnect() first.")
        self._env = ExcavatorEnv(
            task=self.config.task,
            observation_height=self.config.observation_height,
            observation_width=self.config.observation_width,
            scene_set=self.config.scene_set,
            fps=self.config.fps,
            episode_length=_ENDLESS,
            soil=self.config.soil,
            fidelity=self.config.fidelity,
        )
        self._number, self._skipped = self._first, 0
        self._reset()
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
            **dict(zip(STATE_NAMES, state, strict=True)),
            **{camera: pixels[camera].copy() for camera in CAMERAS},
        }

    def depth_m(self) -> NDArray[np.float32]:
        """Return the depth image registered with the main camera.

        Returns:
            Distance along the optical axis [m], shape (H, W), float32.

        Raises:
            DeviceError: The robot is not connected, or was set up without depth.
        """
        if not self.config.depth:
            raise DeviceError("this robot offers no depth image; set --robot.depth=true.")
        return self.env.depth_m()

    def send_action(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Advance the simulation by one frame, or restart it; see the class.

        Args:
            action: `swing.vel`, `boom.vel`, `arm.vel` and `bucket.vel`: numbers or tensors of one element.

        Returns:
            The commands carried out, clipped to [-1, 1]; the action as it came if it restarted the scene.

        Raises:
            DeviceError: The robot is not connected, a command is missing or not finite.
        """
        env = self.env
        if _is_pressed(action, NEXT_SCENE):
            self._number += 1
            self._skipped += 1
            self._restart()
        elif _is_pressed(action, REINITIALISE):
            self._restart()
        elif action and all(name.endswith(".pos") for name in action):
            if not self._is_homing:
                self._restart()
            self._is_homing = True
        else:
            command = command_from_action(action)
            self._observation = env.step(command)[0]
            self._log.count_frame()
            self._is_homing = False
            return dict(zip(ACTION_NAMES, command.tolist(), strict=True))
        return dict(action)

    def _begin_episode(self, episode_index: int) -> None:
        if self.config.advance == "episode":
            self._number = self._first + self._skipped + episode_index
        self._reset()
        self._log.begin(episode_index, scene_id=self.scene_id, target_id=self.target_id)

    def _restart(self) -> None:
        self._log.note_restart()
        self._reset()

    def _reset(self) -> None:
        options = {"scene_id": self.scene_id, "target_id": self.target_id}
        self._observation, _ = self.env.reset(options=options)
        self.episode_count += 1
        self._is_homing = False
        logger.info("Scene %d, target %d of set %s", self.scene_id, self.target_id, self.config.scene_set)

    def _describe(self) -> dict[str, Any]:
        return {
            "simulation_version": SIMULATION_VERSION,
            "scene_set": self.config.scene_set,
            "fps": self.config.fps,
            "soil": self.config.soil,
            "fidelity": self.config.fidelity,
            "observation_height": self.config.observation_height,
            "observation_width": self.config.observation_width,
            "task": self.config.task,
        }


def command_from_action(action: Mapping[str, Any]) -> NDArray[np.float32]:
    """Take the four commands out of LeRobot's dictionary.

    Args:
        action: Numbers or tensors of one element by name.

    Returns:
        Swing, boom, arm, bucket in [-1, 1], shape (4,), float32.

    Raises:
        DeviceError: A command is missing, not a number or not finite.
    """
    missing = [name for name in ACTION_NAMES if name not in action]
    if missing:
        raise DeviceError(
            f"the action lacks {', '.join(missing)}; it holds {', '.join(action) or 'nothing'}. "
            f"Use a teleoperator or a dataset with the actions {', '.join(ACTION_NAMES)}."
        )
    command = np.array([float(action[name]) for name in ACTION_NAMES], dtype=np.float32)
    if not np.isfinite(command).all():
        raise DeviceError(
            f"the action {dict(zip(ACTION_NAMES, command.tolist(), strict=True))} is not finite; "
            "check the device or the policy that sent it."
        )
    return np.clip(command, -1.0, 1.0)


def _is_pressed(action: Mapping[str, Any], key: str) -> bool:
    return float(action.get(key, 0.0)) > 0.5
