"""What determines a set of demonstrations: the same settings give the same dataset, whatever runs it."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.pair import Pair
from lerobot_excav.envs.settings import (
    FIDELITIES,
    SCENE_SETS,
    SOILS,
    TARGETS_PER_SCENE,
    require_fps,
    require_image_size,
    require_task,
)
from lerobot_excav.envs.simulation_version import SIMULATION_VERSION, UNMARKED_VERSION
from lerobot_excav.errors import ConfigurationError, require, require_choice

ENVS = ("excavator",)


@dataclass(frozen=True, kw_only=True)
class DemonstrationSettings:
    """Everything that a demonstration dataset depends on.

    Attributes:
        env: Name of the environment, as in `--env.type`.
        task: Task of the environment.
        scene_set: `train`, `val` or `test`.
        first_scene: Number of the first scene.
        scenes: How many scenes.
        targets: Targets shown per scene: 4 pairs every scene with every target; 1 shows each scene once, going round
            the targets from scene to scene so that all are equally frequent.
        seed: Seed of the operator's variations; with scene and target it seeds every episode.
        fps: Frames per second.
        height: Image height [px].
        width: Image width [px].
        soil: Name of the soil preset.
        fidelity: Numerical effort of the soil.
        episode_length: Time limit [frames].
        keep_failures: Whether episodes without success stay in the dataset.
    """

    env: str = "excavator"
    task: str = "Scoop-v0"
    scene_set: str = "train"
    first_scene: int = 0
    scenes: int = 50
    targets: int = TARGETS_PER_SCENE
    seed: int = 0
    fps: int = 10
    height: int = 96
    width: int = 128
    soil: str = "sand"
    fidelity: str = "standard"
    episode_length: int = 200
    keep_failures: bool = False

    def __post_init__(self) -> None:
        require_choice("--env", self.env, ENVS)
        require_task("--task", self.task)
        require_choice("--scene-set", self.scene_set, SCENE_SETS)
        require_choice("--soil", self.soil, SOILS)
        require_choice("--fidelity", self.fidelity, FIDELITIES)
        require_fps("--fps", self.fps)
        require_image_size("--height", self.height)
        require_image_size("--width", self.width)
        require_choice("--targets", self.targets, range(1, TARGETS_PER_SCENE + 1))
        require(self.scenes >= 1, f"--scenes={self.scenes} must be at least 1")
        require(self.first_scene >= 0, f"--first-scene={self.first_scene} must not be negative")
        require(self.seed >= 0, f"--seed={self.seed} must not be negative")
        require(self.episode_length >= 1, f"--episode-length={self.episode_length} must be at least 1 frame")

    def pairs(self) -> list[Pair]:
        """Return the episodes to record, in dataset order."""
        return [
            Pair(self.env, self.scene_set, scene_id, target_id)
            for scene_id in range(self.first_scene, self.first_scene + self.scenes)
            for target_id in sorted((scene_id + k) % TARGETS_PER_SCENE for k in range(self.targets))
        ]

    def episode_seed(self, pair: Pair) -> tuple[int, int, int]:
        """Return the entropy of the operator's generator in one episode."""
        return (self.seed, pair.scene_id, pair.target_id)

    def as_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)

    def as_record(self) -> dict[str, Any]:
        """Return the fields by name, and the version of the simulation that they are played in."""
        return {"simulation_version": SIMULATION_VERSION, **self.as_dict()}

    @classmethod
    def from_record(cls, record: dict[str, Any], *, source: Path) -> "DemonstrationSettings":
        """Rebuild settings from `as_record`.

        Args:
            record: What `as_record` returned.
            source: Where it was stored, for messages.

        Raises:
            ConfigurationError: It belongs to another version of the simulation, or a field is missing or unknown.
        """
        values = dict(record)
        version = values.pop("simulation_version", UNMARKED_VERSION)
        require(
            version == SIMULATION_VERSION,
            f"{source} is of version {version} of the simulation, and this is version {SIMULATION_VERSION}; "
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
