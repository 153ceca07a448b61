"""What was measured in an evaluation: one line of JSON per episode, as `--env.metrics_path` writes it."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

from lerobot_excav.datasets.json_lines import Line, read_json_lines
from lerobot_excav.envs.simulation_version import UNMARKED_VERSION
from lerobot_excav.errors import DatasetError, require

TASK = "Scoop-v0"


class EpisodeKey(NamedTuple):
    """What makes episodes of two runs comparable."""

    scene_set: str
    scene_id: int
    target_id: int

    def __str__(self) -> str:
        return f"{self.scene_set}/{self.scene_id}/{self.target_id}"


@dataclass(frozen=True, kw_only=True)
class EpisodeMetrics:
    """Outcome of one episode; see `docs/datasets.md` for the definitions.

    Attributes:
        simulation_version: Version of the simulation.
        scene_set: Scene set.
        scene_id: Scene.
        target_id: Target.
        mask_condition: Which mask was shown.
        soil: Soil preset.
        fidelity: Numerical effort of the soil.
        target_success: Whether loading began inside the commanded patch.
        is_success: Whether every part of the task succeeded.
        retained_mass_kg: Soil brought into the box [kg].
        residual_bucket_mass_kg: Soil left in the bucket [kg].
        hard_target_contacts: Hard contacts with the box.
        spill_before_target_events: Losses of soil on the way.
    """

    simulation_version: int
    scene_set: str
    scene_id: int
    target_id: int
    mask_condition: str
    soil: str
    fidelity: str
    target_success: bool
    is_success: bool
    retained_mass_kg: float
    residual_bucket_mass_kg: float
    hard_target_contacts: int
    spill_before_target_events: int

    @property
    def key(self) -> EpisodeKey:
        """Scene and target."""
        return EpisodeKey(self.scene_set, self.scene_id, self.target_id)


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """One evaluation, from one metrics file.

    Attributes:
        path: The file.
        of: How many evaluations the file holds; LeRobot appends one after the other, and this is the last.
        operator: Who dug, if the file says so: `scripted`, `human`, or None for a policy.
        episodes: Outcomes by scene and target.
    """

    path: Path
    of: int
    operator: str | None
    episodes: dict[EpisodeKey, EpisodeMetrics]


def read_evaluation(path: Path) -> Evaluation:
    """Read the last evaluation of a metrics file.

    Args:
        path: The file, or a folder with `metrics.jsonl` in it.

    Raises:
        DatasetError: The file is missing, empty or damaged, a field is missing or of another type, or an episode
            occurs twice.
    """
    path = path / "metrics.jsonl" if path.is_dir() else path
    lines = read_json_lines(path, origin=f"lerobot-eval writes it with --env.metrics_path={path}")
    if not lines:
        raise DatasetError(f"{path} is empty: no episode was finished")
    evaluations = _evaluations(lines)
    last = evaluations[-1]
    return Evaluation(
        path=path,
        of=len(evaluations),
        operator=last[0].record.get("operator"),
        episodes=_by_key(last),
    )


def _evaluations(lines: list[Line]) -> list[list[Line]]:
    """Cut a file where LeRobot began to count anew."""
    starts = [i for i, line in enumerate(lines) if i == 0 or line.record.get("episode_ix") == 0]
    return [lines[a:b] for a, b in zip(starts, [*starts[1:], len(lines)], strict=True)]


def _by_key(lines: Iterable[Line]) -> dict[EpisodeKey, EpisodeMetrics]:
    episodes: dict[EpisodeKey, EpisodeMetrics] = {}
    for line in lines:
        episode = _episode(line)
        if episode.key in episodes:
            raise DatasetError(
                f"{line.place}: scene and target {episode.key} occur twice; are these two evaluations?"
            )
        episodes[episode.key] = episode
    return episodes


def _episode(line: Line) -> EpisodeMetrics:
    # The first version wrote neither its number nor the fidelity, of which it had one only.
    record = {"simulation_version": UNMARKED_VERSION, **line.record}
    if record["simulation_version"] == UNMARKED_VERSION:
        record.setdefault("fidelity", "standard")
    if record.get("task", TASK) != TASK:
        raise DatasetError(f"{line.place}: task={record['task']!r}; reports are made of {TASK} only")
    values: dict[str, Any] = {}
    for field in fields(EpisodeMetrics):
        if field.name not in record:
            raise DatasetError(f"{line.place}: lacks {field.name}; was it written by --env.metrics_path?")
        values[field.name] = _typed(record[field.name], field.type, f"{line.place}: {field.name}")
    return EpisodeMetrics(**values)


def _typed(value: Any, kind: Any, place: str) -> Any:
    """Check a JSON value against a type; whole numbers are numbers, but truth values are not."""
    fits = {
        bool: isinstance(value, bool),
        str: isinstance(value, str),
        int: isinstance(value, int) and not isinstance(value, bool),
        float: isinstance(value, int | float) and not isinstance(value, bool),
    }[kind]
    if not fits:
        raise DatasetError(f"{place}={value!r} is no {kind.__name__}")
    return kind(value)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A policy, or an operator, evaluated once or with several training seeds on the same scenes.

    Attributes:
        label: Name in the report.
        evaluations: One per training seed.
    """

    label: str
    evaluations: tuple[Evaluation, ...]

    def __post_init__(self) -> None:
        first = set(self.evaluations[0].episodes)
        for evaluation in self.evaluations[1:]:
            require(
                set(evaluation.episodes) == first,
                f"{self.label}: {evaluation.path} shows other scenes or targets than {self.evaluations[0].path}; "
                "evaluate every seed with the same --seed and --eval.n_episodes",
            )
        conditions = {(e.mask_condition, e.soil, e.fidelity, e.simulation_version) for e in self.episodes}
        require(
            len(conditions) == 1,
            f"{self.label} mixes mask conditions, soils, fidelities or versions of the simulation: "
            f"{sorted(conditions)}; give each a file of its own",
        )

    @property
    def simulation_version(self) -> int:
        """Version of the simulation, the same for all episodes."""
        return self.episodes[0].simulation_version

    @property
    def soil(self) -> str:
        """Soil preset, the same for all episodes."""
        return self.episodes[0].soil

    @property
    def keys(self) -> list[EpisodeKey]:
        """Scenes and targets, sorted."""
        return sorted(self.evaluations[0].episodes)

    @property
    def episodes(self) -> list[EpisodeMetrics]:
        """All episodes, evaluation by evaluation, each in the order of `keys`."""
        return [evaluation.episodes[key] for evaluation in self.evaluations for key in self.keys]
