"""A policy, or an operator, evaluated on some scenes."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

from lerobot_excav.envs.tasks.measures import EpisodeKey, EpisodeRecord, TaskMeasures
from lerobot_excav.errors import require
from lerobot_excav.evaluation.metrics import Evaluation


@dataclass(frozen=True, kw_only=True)
class Run:
    """A policy, or an operator, evaluated once or with several training seeds on the same scenes.

    Attributes:
        label: Name in the report.
        evaluations: One per training seed.

    Raises:
        ConfigurationError: The evaluations show different scenes, or the episodes were not played alike.
    """

    label: str
    evaluations: tuple[Evaluation, ...]

    def __post_init__(self) -> None:
        first = self.first
        for evaluation in self.evaluations[1:]:
            require(
                evaluation.task == first.task and set(evaluation.episodes) == set(first.episodes),
                f"{self.label}: {evaluation.path} shows other scenes or targets than {first.path}; "
                "evaluate every seed with the same --seed and --eval.n_episodes",
            )
        for name, plural in self.measures.constants.items():
            found = sorted({str(getattr(episode, name)) for episode in self.episodes})
            require(len(found) == 1, f"{self.label} mixes {plural}: {' and '.join(found)}; give each a file of its own")

    @property
    def first(self) -> Evaluation:
        """The first evaluation, or the only one."""
        return self.evaluations[0]

    @property
    def task(self) -> str:
        """Its task."""
        return self.first.task

    @property
    def measures(self) -> TaskMeasures:
        """What is measured of the task."""
        return self.first.measures

    @property
    def constants(self) -> dict[str, Any]:
        """What all episodes share, by name."""
        return {name: getattr(self.episodes[0], name) for name in self.measures.constants}

    @property
    def world(self) -> str:
        """What a scene's number depends on, in words."""
        return self.measures.world.format(**self.constants)

    @property
    def setting(self) -> dict[str, str]:
        """What tells the run apart, by header."""
        return {header: self._words(field) for header, field in self.measures.setting.items()}

    @property
    def keys(self) -> list[EpisodeKey]:
        """Scenes and targets, sorted."""
        return sorted(self.first.episodes)

    @property
    def episodes(self) -> list[EpisodeRecord]:
        """All episodes, evaluation by evaluation, each in the order of `keys`."""
        return [evaluation.episodes[key] for evaluation in self.evaluations for key in self.keys]

    def only(self, keys: Collection[EpisodeKey]) -> "Run":
        """Return the run on some of its scenes and targets."""
        parts = (
            replace(evaluation, episodes={key: evaluation.episodes[key] for key in self.keys if key in keys})
            for evaluation in self.evaluations
        )
        return Run(label=self.label, evaluations=tuple(parts))

    def _words(self, field: str) -> str:
        """Return what all episodes say; where they differ, as in the frames of their commands, the first with that."""
        found = dict.fromkeys(str(getattr(episode, field)) for episode in self.episodes)
        first, *others = found
        return first if not others else f"{first} (and {len(others)} others)"
