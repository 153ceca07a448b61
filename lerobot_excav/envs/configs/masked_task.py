"""What the configurations of all environments of this package share."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, override

import gymnasium as gym
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_IMAGES, OBS_STATE

from lerobot_excav.envs.tasks.settings import (
    RENDER_MODES,
    require_episode_length,
    require_integer,
    require_mask_settings,
    require_task,
    require_view_settings,
)
from lerobot_excav.errors import require, require_choice


@dataclass
class SimulationEnvConfig(EnvConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up an environment of this package from LeRobot's command line.

    `features` and `features_map` are derived from the other fields, whatever is given for them.
    Feature names hold no slash, so that `--eval.recording=true` accepts them.

    Attributes:
        task: Name of the task in the gym namespace `lerobot_excav`.
        fps: Frames per second of simulated time; divides the 50 ticks of a second.
        episode_length: Frames after which an unfinished episode is cut off; None: the environment's own.
        observation_height: Height of every picture [px].
        observation_width: Width of every picture [px].
        scene_set: Stream of scenes: `train`, `val` or `test`. Evaluations meant for a report use `test`.
        mask_condition: What the target mask shows: `correct`, `zero`, `random` or `mismatched`.
        mask_noise: Error of the mask: `none`, `shift`, `erode` or `dilate`; see `envs.mask_noise`.
        mask_noise_px: Size of that error [px].
        metrics_path: JSON Lines file to which every finished episode is appended; see `envs.metrics_log`.
        metrics_episodes: Number of episodes to write; give it `--eval.n_episodes` when the batch size does
            not divide that, and LeRobot's surplus episodes stay out of the file. None writes all.
        render_mode: `rgb_array`, from which LeRobot makes videos, or None.
    """

    CAMERAS: ClassVar[Sequence[str]]
    STATE_SIZE: ClassVar[int]
    ACTION_SIZE: ClassVar[int]
    TASKS: ClassVar[Sequence[str]]

    episode_length: int | None = None
    observation_height: int = 96
    observation_width: int = 128
    scene_set: str = "train"
    mask_condition: str = "correct"
    mask_noise: str = "none"
    mask_noise_px: int = 0
    metrics_path: Path | None = None
    metrics_episodes: int | None = None
    render_mode: str | None = "rgb_array"
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Validate the fields and derive the features.

        Raises:
            ConfigurationError: A field has a value that the environment cannot use.
        """
        require_task("env.task", self.task, self.TASKS)
        require_view_settings(
            "env.",
            scene_set=self.scene_set,
            fps=self.fps,
            observation_height=self.observation_height,
            observation_width=self.observation_width,
        )
        require_mask_settings(
            "env.",
            mask_condition=self.mask_condition,
            mask_noise=self.mask_noise,
            mask_noise_px=self.mask_noise_px,
        )
        require_episode_length("env.episode_length", self.episode_length)
        require_choice("env.render_mode", self.render_mode, RENDER_MODES)
        if self.metrics_episodes is not None:
            hint = "It is the value of --eval.n_episodes; leave it out to write every episode."
            require_integer("env.metrics_episodes", self.metrics_episodes, 1, hint=hint)
        require(
            self.metrics_episodes is None or self.metrics_path is not None,
            f"env.metrics_episodes={self.metrics_episodes} has no effect without a file; "
            "give --env.metrics_path as well.",
        )
        self._derive_features()

    @property
    def package_name(self) -> str:
        """Name of the package whose import registers the gym ids."""
        return "lerobot_excav.envs"

    @property
    def gym_id(self) -> str:
        """Id of the environment in the registry of Gymnasium."""
        return f"lerobot_excav/{self.task}"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of `gymnasium.make` besides the id."""
        shared = {
            "task": self.task,
            "fps": self.fps,
            "episode_length": self.episode_length,
            "observation_height": self.observation_height,
            "observation_width": self.observation_width,
            "scene_set": self.scene_set,
            "mask_condition": self.mask_condition,
            "mask_noise": self.mask_noise,
            "mask_noise_px": self.mask_noise_px,
            "render_mode": self.render_mode,
        }
        return shared | self._own_kwargs()

    @abstractmethod
    def _own_kwargs(self) -> dict[str, Any]:
        """Return the arguments of `gymnasium.make` that this environment alone has."""

    @override
    def create_envs(
        self, n_envs: int, use_async_envs: bool = False
    ) -> dict[str, dict[int, gym.vector.VectorEnv[Any, Any, Any]]]:
        """Create the vector environment of one evaluation.

        Args:
            n_envs: Number of environments that run side by side.
            use_async_envs: Whether each gets a process of its own; needs `n_envs` > 1 to have an effect.

        Returns:
            `{name of the environment: {0: vector environment}}`.
        """
        from lerobot_excav.envs.configs.metrics_log import MetricsLog
        from lerobot_excav.envs.configs.vector import make_vector_env

        log = None
        if self.metrics_path is not None:
            log = MetricsLog(self.metrics_path, n_envs=n_envs, max_episodes=self.metrics_episodes)
        vector = make_vector_env(self._make_one, n_envs, use_async=use_async_envs, metrics_log=log)
        return {self.type: {0: vector}}

    def _make_one(self) -> gym.Env[Any, Any]:
        # Workers unpickle this bound method: that imports this module, hence the package that registers
        # the gym ids, before `gym.make` looks them up.
        return gym.make(self.gym_id, disable_env_checker=self.disable_env_checker, **self.gym_kwargs)

    def _derive_features(self) -> None:
        shape = (self.observation_height, self.observation_width, 3)
        images = [f"{OBS_IMAGES}.{camera}" for camera in self.CAMERAS]
        self.features = {
            ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(self.ACTION_SIZE,)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(self.STATE_SIZE,)),
            **{image: PolicyFeature(type=FeatureType.VISUAL, shape=shape) for image in images},
        }
        self.features_map = {ACTION: ACTION, "agent_pos": OBS_STATE, **{image: image for image in images}}
