"""What determines a set of demonstrations: the same settings give the same dataset, whatever runs it."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.record.environment import EnvironmentDescription
from lerobot_excav.datasets.record.environments import ENVIRONMENTS, environment_named
from lerobot_excav.datasets.record.target_rule import TARGET_RULES, targets_of_scene
from lerobot_excav.envs.tasks.settings import (
    LAST_SCENE,
    SCENE_SETS,
    TARGETS_PER_SCENE,
    require_fps,
    require_image_size,
    require_integer,
)
from lerobot_excav.errors import ConfigurationError, require, require_choice

EXTRA_SETTINGS = tuple(dict.fromkeys(name for known in ENVIRONMENTS.values() for name in known.settings))
"""Fields that have a meaning in some environments only."""
_ADDED_LATER = {"target_rule": "round", "storage": "image"}
"""Fields that stored settings may lack, and what was done before there was a choice."""


@dataclass(frozen=True, kw_only=True)
class DemonstrationSettings:
    """Everything that a demonstration dataset depends on.

    The defaults are the excavator's; `of` makes settings of any environment.

    Attributes:
        env: Name of the environment, as in `--env.type`.
        task: Task of the environment.
        scene_set: `train`, `val` or `test`.
        first_scene: Number of the first scene.
        scenes: How many scenes.
        targets: Targets shown per scene: 4 pairs every scene with every target, 1 shows each scene once.
        target_rule: Which target is shown if it is one: `round` goes round the targets from scene to scene so that all
            are equally frequent, `uniform` draws it, `nearest` takes the one nearest to the gripper at the start.
        seed: Seed of the operator's variations and of drawn targets; with scene and target it seeds every episode.
        fps: Frames per second.
        height: Image height [px].
        width: Image width [px].
        soil: Name of the soil preset; None in an environment without soil.
        fidelity: Numerical effort of the soil; None in an environment without soil.
        storage: How pictures are stored: `image` or `video`; see `storage`.
        episode_length: Time limit [frames].
        keep_failures: Whether episodes without success stay in the dataset.
    """

    env: str = "excavator"
    task: str = "Scoop-v0"
    scene_set: str = "train"
    first_scene: int = 0
    scenes: int = 50
    targets: int = TARGETS_PER_SCENE
    target_rule: str = "round"
    seed: int = 0
    fps: int = 10
    height: int = 96
    width: int = 128
    soil: str | None = "sand"
    fidelity: str | None = "standard"
    storage: str = "image"
    episode_length: int = 200
    keep_failures: bool = False

    def __post_init__(self) -> None:
        require_choice("--task", self.task, self.environment.tasks)
        require_choice("--scene-set", self.scene_set, SCENE_SETS)
        require_fps("--fps", self.fps)
        require_image_size("--height", self.height)
        require_image_size("--width", self.width)
        require_choice("--storage", self.storage, STORAGES)
        require_choice("--targets", self.targets, range(1, TARGETS_PER_SCENE + 1))
        require(self.scenes >= 1, f"--scenes={self.scenes} must be at least 1")
        require_integer("--first-scene", self.first_scene, 0, LAST_SCENE)
        require(self.seed >= 0, f"--seed={self.seed} must not be negative")
        require(self.episode_length >= 1, f"--episode-length={self.episode_length} must be at least 1 frame")
        self._require_extra_settings()
        self._require_target_rule()

    def _require_extra_settings(self) -> None:
        known = self.environment.settings
        for name in EXTRA_SETTINGS:
            option, value = f"--{name}", getattr(self, name)
            if name in known:
                require_choice(option, value, known[name].choices)
            require(
                name in known or value is None,
                f"{option}={value!r} has no meaning for --env={self.env}, which has no such setting; leave it out",
            )

    def _require_target_rule(self) -> None:
        option = f"--target-rule={self.target_rule}"
        require_choice("--target-rule", self.target_rule, TARGET_RULES)
        require(
            self.targets == 1 or self.target_rule == "round",
            f"{option} chooses a single target per scene; add --targets=1, or leave it out",
        )
        require(
            self.environment.nearest_target is not None or self.target_rule != "nearest",
            f"{option} has no meaning for --env={self.env}, which tells no target as the nearest; "
            "allowed: 'round', 'uniform'",
        )

    @classmethod
    def of(cls, env: str, **changes: Any) -> "DemonstrationSettings":
        """Return the default settings of an environment.

        Args:
            env: Name of the environment.
            changes: Fields that differ from the defaults.

        Raises:
            ConfigurationError: There is no such environment, or a field is not possible in it.
        """
        absent: dict[str, Any] = dict.fromkeys(EXTRA_SETTINGS)
        environment = environment_named("--env", env)
        fps = changes.get("fps", environment.fps)
        defaults = environment.defaults | {"episode_length": environment.length_at(fps)}
        return cls(**{"env": env, **absent, **defaults, **changes})

    @property
    def environment(self) -> EnvironmentDescription:
        """What is known of the environment."""
        return environment_named("--env", self.env)

    @property
    def extra(self) -> dict[str, Any]:
        """The settings that not every environment has, by name."""
        return {name: getattr(self, name) for name in self.environment.settings}

    def pairs(self) -> list[Pair]:
        """Return the episodes to record, in dataset order."""
        return [
            Pair(self.env, self.scene_set, scene_id, target_id)
            for scene_id in range(self.first_scene, self.first_scene + self.scenes)
            for target_id in targets_of_scene(
                self.target_rule,
                self.targets,
                seed=self.seed,
                scene_set=self.scene_set,
                scene_id=scene_id,
                nearest=self.environment.nearest_target,
            )
        ]

    def episode_seed(self, pair: Pair) -> tuple[int, int, int]:
        """Return the entropy of the operator's generator in one episode."""
        return (self.seed, pair.scene_id, pair.target_id)

    def as_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)

    def as_record(self) -> dict[str, Any]:
        """Return the fields by name, and the version of the simulation that they are played in."""
        return {"simulation_version": self.environment.simulation_version, **self.as_dict()}

    @classmethod
    def from_record(cls, record: dict[str, Any], *, source: Path) -> "DemonstrationSettings":
        """Rebuild settings from `as_record`.

        Args:
            record: What `as_record` returned.
            source: Where it was stored, for messages.

        Raises:
            ConfigurationError: It belongs to another version of the simulation, or a field is missing or unknown.
        """
        values = {**_ADDED_LATER, **record}
        environment = environment_named(f"env in {source}", record.get("env", ""))
        version = values.pop("simulation_version", environment.unmarked_version)
        current = environment.simulation_version
        require(
            version == current,
            f"{source} is of version {version} of the simulation, and this is version {current}; "
            "choose another --out, or install the release of lerobot_env_excav that began it",
        )
        unlike = sorted(set(values) ^ {field.name for field in fields(cls)})
        require(not unlike, f"{source} has other settings ({', '.join(unlike)}); choose another --out")
        return cls(**values)

    def require_same(self, other: "DemonstrationSettings") -> None:
        """Check that a started run has these settings.

        Args:
            other: Settings of the started run.

        Raises:
            ConfigurationError: A field differs.
        """
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if mine != theirs:
                raise ConfigurationError(_difference(field.name.replace("_", "-"), mine, theirs))


def _difference(option: str, mine: Any, theirs: Any) -> str:
    if isinstance(mine, bool):
        has, do = ("has", "with") if theirs else ("does not have", "without")
        return f"the started run {has} --{option}; continue it {do} --{option}, or choose another --out"
    return (
        f"--{option}={mine} differs from the started run, which has {theirs}; "
        f"continue it with --{option}={theirs}, or choose another --out"
    )
