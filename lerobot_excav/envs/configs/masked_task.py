"""What the configurations of all environments share for LeRobot's commands, besides the settings of their tasks."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, override

import gymnasium as gym
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_IMAGES, OBS_STATE

from lerobot_excav.envs.holder import holder_of
from lerobot_excav.envs.tasks.masked_env import MOST_HELD_FRAMES, RENDER_MODES
from lerobot_excav.envs.tasks.registry import task_of_settings, task_settings
from lerobot_excav.envs.tasks.settings import RenderSettings, TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import require, require_choice
from lerobot_excav.setting import declared_settings, setting


@dataclass(kw_only=True)
class MaskedTaskEnvConfig(RenderSettings, EnvConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up an environment of this package from LeRobot's command line.

    Put the settings of a task before this class, and register the result with LeRobot:

        @EnvConfig.register_subclass("excavator")
        @dataclass(kw_only=True)
        class ExcavatorEnvConfig(ExcavatorSettings, MaskedTaskEnvConfig):
            PREFIX: ClassVar[str] = "env."

    `features` and `features_map` are derived from the other fields, whatever is given for them. Feature names hold no
    slash, so that `--eval.recording=true` accepts them.

    Raises:
        ConfigurationError: A field has a value that the environment cannot use.
    """

    metrics_path: Path | None = setting(
        "JSON Lines file to which every finished episode is appended, for lerobot-excav report", default=None
    )
    metrics_episodes: int | None = setting(
        "Episodes to write there; give it the value of --eval.n_episodes when the batch size does not divide that, and "
        "LeRobot's surplus episodes stay out of the file",
        default=None,
        low=1,
    )
    render_mode: str | None = setting(
        "rgb_array, from which LeRobot makes videos, or null", default="rgb_array", choices=RENDER_MODES
    )
    camera_every: int = setting(
        "Draw what the policy sees every n-th frame, counted from the start and from the last change of the mask, and "
        "show it until then. With the same --policy.n_action_steps the results of mask_act are the same, for it looks "
        "at no other pictures, and evaluation is faster; other policies see a slow camera",
        default=1,
        low=1,
        high=MOST_HELD_FRAMES,
    )
    # LeRobot's own fields, explained.
    features: dict[str, PolicyFeature] = field(
        default_factory=dict, metadata={"custom_args": {"help": "Derived from the other fields, whatever is given"}}
    )
    features_map: dict[str, str] = field(
        default_factory=dict, metadata={"custom_args": {"help": "Derived from the other fields, whatever is given"}}
    )
    max_parallel_tasks: int = setting(
        "Tasks that LeRobot evaluates at a time; here an evaluation has one", default=1, choices=(1,)
    )
    disable_env_checker: bool = setting("Whether to skip Gymnasium's checks of the environment", default=True)

    def __post_init__(self) -> None:
        require(
            self.metrics_episodes is None or self.metrics_path is not None,
            f"env.metrics_episodes={self.metrics_episodes} has no effect without a file; "
            "give --env.metrics_path as well.",
        )
        self.require_film_effect("env.")
        require_choice("env.render_camera", self.render_camera, self.task_spec.views)
        self._derive_features()

    @property
    def task_spec(self) -> TaskSpec:
        """The task.

        Raises:
            ConfigurationError: This environment has no such task.
        """
        return task_of_settings(cast(TaskSettings, self))

    @property
    def package_name(self) -> str:
        """Name of the package whose import registers the gym ids."""
        return "lerobot_excav.envs"

    @property
    def gym_id(self) -> str:
        """Id of the environment in the registry of Gymnasium."""
        return self.task_spec.gym_id

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of `gymnasium.make` besides the id."""
        settings = task_settings(cast(TaskSettings, self))
        shown = {name: getattr(self, name) for name in declared_settings(RenderSettings)}
        return {**settings.as_dict(), **shown, "render_mode": self.render_mode, "camera_every": self.camera_every}

    @override
    def create_envs(
        self, n_envs: int, use_async_envs: bool = False
    ) -> dict[str, dict[int, gym.vector.VectorEnv[Any, Any, Any]]]:
        """Create the vector environment of one evaluation, as `{self.type: {0: vector environment}}`.

        With `use_async_envs` each of several environments gets a process of its own.

        Raises:
            ConfigurationError: The command wants LeRobot's recording of more than one batch, which it cannot write.
        """
        self._require_one_recorded_batch(n_envs)
        from lerobot_excav.envs.configs.metrics_log import MetricsLog
        from lerobot_excav.envs.configs.vector import make_vector_env

        log = None
        if self.metrics_path is not None:
            log = MetricsLog(self.metrics_path, n_envs=n_envs, max_episodes=self.metrics_episodes)
        vector = make_vector_env(self._make_one, n_envs, use_async=use_async_envs, metrics_log=log)
        return {self.type: {0: vector}}

    def _require_one_recorded_batch(self, n_envs: int) -> None:
        """Raise where LeRobot 0.6.1 would end in a FileExistsError after the first batch."""
        evaluation: Any = getattr(holder_of(self, "env"), "eval", None)
        if evaluation is None or not getattr(evaluation, "recording", False):
            return
        require(
            evaluation.n_episodes <= n_envs,
            f"--eval.recording=true records one batch only, and --eval.n_episodes={evaluation.n_episodes} "
            f"needs several of {n_envs}. Leave it out, or give --eval.batch_size the number of episodes. "
            "`lerobot-rollout --strategy.type=episodic` records what a policy does in a way that can be trained on.",
        )

    def _make_one(self) -> gym.Env[Any, Any]:
        # Workers unpickle this bound method: that imports the module of the configuration, hence the package that
        # registers the gym ids, before `gym.make` looks them up.
        return gym.make(self.gym_id, disable_env_checker=self.disable_env_checker, **self.gym_kwargs)

    def _derive_features(self) -> None:
        spec, settings = self.task_spec, cast(TaskSettings, self)
        images = [f"{OBS_IMAGES}.{camera}" for camera in spec.cameras]
        shape = (*settings.observation_size, 3)
        self.features = {
            ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(len(spec.action_names),)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(len(spec.state_names),)),
            **{image: PolicyFeature(type=FeatureType.VISUAL, shape=shape) for image in images},
        }
        self.features_map = {ACTION: ACTION, "agent_pos": OBS_STATE, **{image: image for image in images}}
