"""What every simulated machine of this package shares as a LeRobot robot.

Every `send_action` advances the simulation by exactly one frame, 1/`fps` s, however long the command takes
in real time. So a recording is consistent at any speed, and sending its actions again from the same start
repeats its states bit for bit.

Every recorded episode starts from a fresh reset. With `advance=episode`, episode N of a dataset shows scene
`scene_id + (target_id + N) // 4` with target `(target_id + N) % 4`; recording it again repeats both. Each press of
`next_scene` between two episodes leaves one target out. A recording that is resumed with the same session log goes on
behind its last episode.
"""

import logging
import weakref
from collections.abc import Mapping
from datetime import datetime
from typing import Any, ClassVar, override

import numpy as np
from lerobot.robots import Robot
from numpy.typing import NDArray

from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.registry import task_settings
from lerobot_excav.envs.tasks.selection import TargetAbsentError
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.config_simulated_robot import SimulatedRobotConfig
from lerobot_excav.robots.recording_command import operator_of, recorded_text, require_fitting_command
from lerobot_excav.robots.recording_phases import RecordingPhases
from lerobot_excav.robots.rerun_log import RerunLog
from lerobot_excav.robots.session_log import SessionLog, default_path
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE, is_pressed
from lerobot_excav.robots.target_order import TargetOrder

logger = logging.getLogger(__name__)


class SimulatedRobot(Robot):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A machine in a simulated scene with a commanded target; a subclass names it and its configuration.

    Besides its commands an action may hold `reinitialise` or `next_scene`; a value above 0.5 restarts the
    scene or moves on instead of advancing the simulation. An action with positions only, such as `lerobot-rollout`
    sends between episodes to drive a robot home, restarts the scene once if the machine takes no positions.

    Attributes:
        task_spec: Names, units and limits of the task.
        cameras: The cameras by name, with the shape (H, W, 3) of their pictures.
        episode_count: Number of resets so far; changes exactly when an episode starts.
    """

    connected: ClassVar["weakref.WeakSet[SimulatedRobot]"] = weakref.WeakSet()
    """The simulated robots that are connected in this process."""

    def __init__(self, config: SimulatedRobotConfig) -> None:
        command = require_fitting_command(config)
        self._operator = operator_of(command)
        super().__init__(config)
        self.config: Any = config
        self.task_spec = spec = config.task_spec
        self.settings = task_settings(self.config)
        self.cameras = dict.fromkeys(spec.cameras, (*self.settings.observation_size, 3))
        self.episode_count = 0
        self._env: MaskedTaskEnv[Any, Any] | None = None
        self._rerun_log: RerunLog
        self._observation: dict[str, Any] = {}
        self._is_homing = False
        self._held_frames = 0
        log_path = config.session_log or default_path(f"{self.name}_sessions", datetime.now())
        self._log = SessionLog(log_path, spec, self.settings, recorded_text(command))
        self._order = self._make_order()
        self._phases = RecordingPhases(
            on_episode=self._begin_episode,
            on_pause=self._end_episode,
            on_discard=self._discard_episode,
            on_stop=self._log.stop,
        )

    def make_env(self) -> MaskedTaskEnv[Any, Any]:
        """Make the environment that the configuration describes, without an end to its episodes."""
        endless = {**self.settings.as_dict(), "episode_length": ENDLESS_FRAMES}
        env: MaskedTaskEnv[Any, Any] = self.task_spec.make_env(**endless)
        return env

    @property
    def observation_features(self) -> dict[str, type | tuple[int, int, int]]:
        """Scalars in the order of `agent_pos`, and the cameras."""
        return {**dict.fromkeys(self.task_spec.state_names, float), **self.cameras}

    @property
    def action_features(self) -> dict[str, type]:
        """Commands in the order of the environment's action."""
        return dict.fromkeys(self.task_spec.action_names, float)

    @property
    def env(self) -> MaskedTaskEnv[Any, Any]:
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
        return self._order.start[0]

    @property
    def target_id(self) -> int:
        """Current target of the scene."""
        return self._order.start[1]

    @property
    def start(self) -> dict[str, int]:
        """Current scene, stage and target, as options of the environment's `reset`."""
        return {"scene_id": self.scene_id, "stage": self.config.stage, "target_id": self.target_id}

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
            DeviceError: The robot is connected already, or its session log cannot be written.
            MaskMissingError: No mask is found for the first target; the robot stays disconnected.
        """
        if self._env is not None:
            raise DeviceError(f"the robot {self.name} is connected already; call disconnect() first.")
        self._log.start()
        self._order = self._make_order()
        try:
            self._env = self.make_env()
            self._rerun_log = RerunLog(
                self._env, dict.fromkeys((*self.task_spec.state_names, *self.task_spec.action_names))
            )
            self.start_scene()
        except Exception:
            if self._env is not None:
                self._env.close()
            self._env = None
            self._log.close()
            raise
        logging.getLogger().addHandler(self._phases)
        self.connected.add(self)

    def disconnect(self) -> None:
        """Stop the simulation and close the session log.

        Raises:
            DeviceError: The robot is not connected.
        """
        env = self.env
        self._env = None
        self.connected.discard(self)
        logging.getLogger().removeHandler(self._phases)
        env.close()
        self._log.close()

    def get_observation(self) -> dict[str, Any]:
        """Return the current state and pictures; a second call without an action returns the same.

        If a recording of Rerun is open, as with `--display_data=true`, what else there is to see goes there.

        Raises:
            DeviceError: The robot is not connected.
        """
        _ = self.env
        pixels = self._observation["pixels"]
        self._rerun_log.show(self._observation)
        return {
            **dict(zip(self.task_spec.state_names, self._state, strict=True)),
            **{camera: pixels[camera].copy() for camera in self.cameras},
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
        env, names = self.env, self.task_spec.action_names
        if self._drives_home(action):
            if not self._is_homing:
                self._restart_scene(action)
            self._is_homing = True
            return dict(action)
        if is_pressed(action, NEXT_SCENE):
            self._order.press()
            self._restart_scene(action)
            return dict(action)
        if is_pressed(action, REINITIALISE):
            self._restart_scene(action)
            return dict(action)
        wanted, state = command_from_action(action, names), self._state
        limits = self.task_spec.action_low, self.task_spec.action_high
        command = np.clip(wanted, *limits).astype(np.float32)
        self._observation, *_, info = env.step(command)
        self._is_homing = False
        # LeRobot records the action as it came.
        self._log.note_action(state, wanted.tolist(), info.get("target_id"), info.get("command_frame", 0))
        if info["mask_missing_frames"] > self._held_frames:
            self._log.note_held()
        self._held_frames = info["mask_missing_frames"]
        self._require_mask(info)
        return dict(zip(names, command.tolist(), strict=True))

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

    def note_operator(self, operator: str) -> None:
        """Take note of who drives, `scripted`, for the session log; otherwise it is who the command says."""
        self._log.note_operator(operator)

    def start_scene(self) -> None:
        """Reset the environment to the current scene and target, or the next one that its start offers."""
        self._observation, info = self._reset()
        self._held_frames = info["mask_missing_frames"]
        self._is_homing = False
        self._require_mask(info)
        self.episode_count += 1
        logger.info("Scene %d, target %d of set %s", self.scene_id, self.target_id, self.settings.scene_set)

    def _reset(self) -> tuple[dict[str, Any], dict[str, Any]]:
        for _ in range(self.task_spec.target_count - 1):
            try:
                return self.env.reset(options=dict(self.start))
            except TargetAbsentError as absent:  # late stages of a scene have fewer regions
                logger.warning("%s; the next one is shown", absent)
                self._order.skip()
        return self.env.reset(options=dict(self.start))

    def _begin_episode(self, episode_index: int) -> None:
        self._order.begin(episode_index)
        self.start_scene()
        self._log.begin(episode_index, **self.start)
        if self._operator is not None:
            self._log.note_operator(self._operator)
        if self._held_frames:
            self._log.note_held()

    @property
    def _state(self) -> list[float]:
        """What is felt of the machine now."""
        state: list[float] = self._observation["agent_pos"].tolist()
        return state

    def _restart_scene(self, action: Mapping[str, Any]) -> None:
        """Start the current scene, which may be another one now, instead of carrying an action out."""
        names = self.task_spec.action_names
        state, wanted = None, None
        if all(name in action for name in names):  # else LeRobot has no frame to record
            state, wanted = self._state, command_from_action(action, names).tolist()
        self.start_scene()
        self._log.note_restart(state, wanted, **self.start)

    def _end_episode(self) -> None:
        self._order.end()
        self._log.end()

    def _discard_episode(self) -> None:
        self._order.discard()
        self._log.discard()

    def _make_order(self) -> TargetOrder:
        config, count = self.config, self.task_spec.starts_per_scene
        first = config.scene_id * count + config.target_id
        by_episode = config.advance == "episode"
        return TargetOrder(first, by_episode=by_episode, per_scene=count, stage=config.stage, log_path=self._log.path)

    def _drives_home(self, action: Mapping[str, Any]) -> bool:
        """Tell whether an action holds positions only, and the machine takes none."""
        takes_positions = any(name.endswith(".pos") for name in self.task_spec.action_names)
        return bool(action) and not takes_positions and all(name.endswith(".pos") for name in action)

    def _require_mask(self, info: Mapping[str, Any]) -> None:
        if info.get("mask_missing"):
            raise MaskMissingError(
                f"robot.mask_source={self.settings.mask_source!r} finds nothing for target {info['target_id']} of "
                f"scene {self.scene_id} ({self.settings.scene_set}), so the machine would be driven without a target; "
                "begin with another --robot.scene_id or --robot.target_id, choose larger pictures or another source."
            )


def command_from_action(action: Mapping[str, Any], names: tuple[str, ...]) -> NDArray[np.float32]:
    """Take the commands, (names,) float32, out of LeRobot's dictionary of numbers or tensors of one element.

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
