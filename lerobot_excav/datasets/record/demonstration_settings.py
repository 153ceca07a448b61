"""What determines a set of demonstrations: the same settings give the same dataset, whatever runs it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.record.change_odds import LATE_S, ChangeOdds
from lerobot_excav.datasets.record.stage_list import draw_stages, parse_stages, stage_list
from lerobot_excav.datasets.record.target_rule import TARGET_RULES, targets_of_start
from lerobot_excav.envs.tasks.registry import env_types, task_of_settings
from lerobot_excav.envs.tasks.settings import LAST_SCENE, SCENE_SETS, TARGETS_PER_SCENE, TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import ConfigurationError, require, require_choice, shown
from lerobot_excav.setting import check_settings, declared_settings, setting

MOST_SCENES, MOST_FRAMES = 100_000, 100_000  # more is a slip of the keyboard: it would fill the memory
MOST_CHANGES = 20  # nobody could follow more within an episode


@dataclass(kw_only=True)
class PlayedScenes:
    """Which scenes a scripted operator plays, in which environment.

    Attributes:
        env: Settings of the environment.

    Raises:
        ConfigurationError: A field has a value that is not possible, or has no meaning in this environment.
    """

    PREFIX: ClassVar[str] = "--"

    env: TaskSettings
    first_scene: int = setting("Number of the first scene", default=0, low=0, high=LAST_SCENE)
    scenes: int = setting("How many scenes", default=50, low=1, high=MOST_SCENES)
    targets: int | None = setting(
        "Targets shown per start: 4 pair every scene with every target, 1 shows each scene once; left out: 4, and 1 "
        "with a task that chooses its targets itself",
        default=None,
        choices=tuple(range(1, TARGETS_PER_SCENE + 1)),
    )
    target_rule: str = setting(
        "With one target: go round the targets from start to start, draw it, or take the nearest: the block nearest to "
        "the gripper, the region with the shortest swing to the box",
        default="round",
        choices=TARGET_RULES,
    )
    seed: int = setting(
        "Seed of the operator's variations, of drawn targets and of changes of mind", default=0, low=0, high=2**63 - 1
    )

    def __post_init__(self) -> None:
        check_settings(self, self.PREFIX)
        require(
            isinstance(self.env, TaskSettings),
            f"env={shown(self.env)} is not the settings of an environment; DemonstrationSettings.of makes them by name",
        )
        option, spec = f"--target_rule={self.target_rule}", self.task_spec
        self.targets = self.targets or spec.starts_per_scene
        require(
            self.targets == 1 or self.target_rule == "round",
            f"{option} chooses a single target per scene; add --targets=1, or leave it out",
        )
        require(
            self.target_rule != "nearest" or spec.nearest_target_entry is not None,
            f"{option} has no meaning for --env.type={spec.env_type} with {spec.id}, which tells no target as the "
            "nearest; allowed: round, uniform",
        )
        require(
            self.first_scene + self.scenes - 1 <= LAST_SCENE,
            f"--scenes={self.scenes} from --first_scene={self.first_scene} on is not possible; "
            f"the last scene is {LAST_SCENE}",
        )
        require(
            self.episode_length <= MOST_FRAMES,
            f"--env.episode_length={self.episode_length} is too long to be kept; give a number up to {MOST_FRAMES}",
        )
        for name in spec.settings.columns():
            value = getattr(self.env, name)
            require(isinstance(value, str), f"--env.{name}={value!r} cannot be kept in a dataset; give it by name")

    @property
    def task_spec(self) -> TaskSpec:
        """The task that is played."""
        return task_of_settings(self.env)

    @property
    def episode_length(self) -> int:
        """Time limit [frames]."""
        return self.env.episode_length or self.task_spec.length_at(self.env.fps)

    @property
    def scene_ids(self) -> range:
        """The scenes."""
        return range(self.first_scene, self.first_scene + self.scenes)

    @property
    def listed_stages(self) -> tuple[range, ...]:
        """What the stages of a scene are drawn from: one of each range, which may hold a single one; rising."""
        return (range(1),)

    def stages_of(self, scene_id: int) -> tuple[int, ...]:
        """Return the stages that a scene is shown at, rising."""
        return draw_stages(self.listed_stages, self.seed, SCENE_SETS.index(self.env.scene_set), scene_id)

    @property
    def change_odds(self) -> ChangeOdds:
        """What the changes of mind of an episode are drawn from."""
        return ChangeOdds()

    @property
    def episode_count(self) -> int:
        """How many episodes are to be played."""
        return self.scenes * len(self.listed_stages) * (self.targets or 1)  # it has been filled in

    def pairs(self) -> list[Pair]:
        """Return the episodes to play, in their order: those of a scene side by side, and of a stage within it."""
        return [
            pair
            for scene_id in self.scene_ids
            for stage in self.stages_of(scene_id)
            for pair in self.pairs_of_start(scene_id, stage)
        ]

    def pairs_of_start(self, scene_id: int, stage: int) -> list[Pair]:
        """Return the episodes to play from a start; the nearest target of a later one takes long to find."""
        targets = targets_of_start(
            self.target_rule,
            self.targets or 1,  # it has been filled in
            seed=self.seed,
            settings=self.env,
            scene_id=scene_id,
            stage=stage,
            place=self.stages_of(scene_id).index(stage),
        )
        return [self.pair(scene_id, stage, target_id) for target_id in targets]

    def pair(self, scene_id: int, stage: int, target_id: int) -> Pair:
        """Return the name of a start that is shown with a target."""
        return Pair(self.env.ENV_TYPE, self.env.scene_set, scene_id, stage, target_id)

    def episode_seed(self, pair: Pair) -> tuple[int, ...]:
        """Return the entropy of the operator's generator in one episode."""
        seed = (self.seed, pair.scene_id, pair.target_id)
        return (*seed, pair.stage) if pair.stage else seed


@dataclass(kw_only=True)
class DemonstrationSettings(PlayedScenes):
    """Everything that a demonstration dataset depends on."""

    storage: str | None = setting(
        "How pictures are stored: image keeps each as PNG, video all of them without loss, which long action chunks "
        "need; left out: what suits the task",
        default=None,
        choices=STORAGES,
    )
    retarget: float = setting(
        "Share of the episodes with a change of mind: another target is commanded at a moment drawn from those before "
        "the operator would touch the first",
        default=0.0,
        low=0.0,
        high=1.0,
    )
    retarget_times: int = setting(
        "Most changes of mind of such an episode, each on the way to the target before; how many it has is drawn",
        default=1,
        low=1,
        high=MOST_CHANGES,
    )
    retarget_late: float = setting(
        f"Share of these changes that come in the last {LATE_S} s before the operator would touch its target; the "
        "others are drawn from its whole way",
        default=0.0,
        low=0.0,
        high=1.0,
    )
    keep_failures: bool = setting("Whether episodes without success stay in the dataset, marked as such", default=False)
    stages: str = setting(
        "Stages at which every scene is shown, such as 0,4,8: after so many cycles that a seeded operator has dug "
        "before; 0,1-13 shows it at 0 and at one drawn from 1 to 13. From stage 1 on an episode starts where the last "
        "dump has ended",
        default="0",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        self.storage = self.storage or self.task_spec.storage
        require(
            self.retarget == 0.0
            or (self.task_spec.default_target is None and getattr(self.env, "retarget_frame", None) is None),
            f"--retarget={self.retarget} has no meaning for {self.task_spec.id} with these settings: the task itself "
            "says when the command changes; leave it out",
        )
        for name, without in (("retarget_times", 1), ("retarget_late", 0.0)):
            value = getattr(self, name)
            require(
                value == without or self.retarget > 0.0,
                f"--{name}={value} has no effect with --retarget=0; add the share of the episodes that change their "
                "mind, such as --retarget=0.7",
            )
        self.stages = stage_list(parse_stages(f"{self.PREFIX}stages", self.stages, self.task_spec))

    @property
    def listed_stages(self) -> tuple[range, ...]:
        """What the stages of a scene are drawn from: one of each range, which may hold a single one; rising."""
        return parse_stages(f"{self.PREFIX}stages", self.stages, self.task_spec)

    @property
    def change_odds(self) -> ChangeOdds:
        """What the changes of mind of an episode are drawn from."""
        return ChangeOdds(self.retarget, self.retarget_times, self.retarget_late)

    def possible_pairs(self) -> list[Pair]:
        """Return the episodes that may be played, whichever targets the rule chooses."""
        return [
            self.pair(scene_id, stage, target_id)
            for scene_id in self.scene_ids
            for stage in self.stages_of(scene_id)
            for target_id in range(self.task_spec.target_count)
        ]

    @classmethod
    def of(cls, env_type: str, env: Mapping[str, Any] | None = None, **settings: Any) -> "DemonstrationSettings":
        """Make settings of an environment named by its `--env.type`; `env` holds those of the environment itself.

        Raises:
            ConfigurationError: There is no such environment, or a field is not possible in it.
        """
        require_choice("--env.type", env_type, tuple(env_types()))
        for name in settings:
            require_choice("option", f"--{name}", tuple(f"--{known}" for known in declared_settings(cls)))
        return cls(env=env_types()[env_type].settings.of(env or {}, place="--env."), **settings)

    def as_record(self) -> dict[str, Any]:
        """Return the fields by name, and the version of the simulation that they are played in."""
        return {
            "simulation_version": self.task_spec.simulation_version,
            "env.type": self.env.ENV_TYPE,
            **{f"env.{name}": value for name, value in self.env.as_dict().items()},
            **{name: getattr(self, name) for name in declared_settings(DemonstrationSettings)},
        }

    @classmethod
    def from_record(cls, record: Mapping[str, Any], *, source: Path) -> "DemonstrationSettings":
        """Rebuild settings from `as_record`, which was stored in the file `source`.

        Raises:
            ConfigurationError: It belongs to another version of the simulation, or a field is missing or unknown.
        """
        values = dict(record)
        env_type, version = values.pop("env.type", None), values.pop("simulation_version", None)
        require_choice(f"env.type in {source}", env_type, tuple(env_types()))
        current = env_types()[str(env_type)].simulation_version
        require(
            version == current,
            f"{source} is of version {version} of the simulation, and this is version {current}; "
            "choose another --out, or install the release of lerobot_env_excav that began it",
        )
        values.setdefault("retarget", 0.0)  # recorded before there were changes of mind,
        values.setdefault("retarget_times", 1)  # or several of them,
        values.setdefault("retarget_late", 0.0)  # or late ones
        known = set(declared_settings(cls))
        env = {name.removeprefix("env."): values.pop(name) for name in list(values) if name.startswith("env.")}
        unlike = sorted(values.keys() ^ known)
        require(not unlike, f"{source} has other settings ({', '.join(unlike)}); choose another --out")
        return cls.of(str(env_type), env, **values)

    def require_same(self, other: "DemonstrationSettings") -> None:
        """Check that a started run has these settings.

        Raises:
            ConfigurationError: A field differs.
        """
        theirs = other.as_record()
        for name, mine in self.as_record().items():
            if mine != theirs.get(name):
                shown, there = (
                    str(value).lower() if isinstance(value, bool) else value for value in (mine, theirs.get(name))
                )
                raise ConfigurationError(
                    f"--{name}={shown} differs from the started run, which has {there}; "
                    f"continue it with --{name}={there}, or choose another --out"
                )
