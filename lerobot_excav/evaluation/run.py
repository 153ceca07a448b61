"""A policy, or an operator, evaluated on some scenes."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

from lerobot_excav.errors import require
from lerobot_excav.evaluation.episode import Episode, EpisodeKey
from lerobot_excav.evaluation.metrics import Evaluation
from lerobot_excav.evaluation.task_table import TaskTable


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
        first = self.evaluations[0]
        for evaluation in self.evaluations[1:]:
            require(
                evaluation.table is first.table and set(evaluation.episodes) == set(first.episodes),
                f"{self.label}: {evaluation.path} shows other scenes or targets than {first.path}; "
                "evaluate every seed with the same --seed and --eval.n_episodes",
            )
        names = list(self.table.constants.values())
        conditions = {self._constants(episode) for episode in self.episodes}
        require(
            len(conditions) == 1,
            f"{self.label} mixes {', '.join(names[:-1])} or {names[-1]}: {sorted(map(str, conditions))}; "
            "give each a file of its own",
        )

    def _constants(self, episode: Episode) -> tuple[Any, ...]:
        return tuple(getattr(episode, name) for name in self.table.constants)

    @property
    def table(self) -> TaskTable:
        """What reports know of the task."""
        return self.evaluations[0].table

    @property
    def constants(self) -> dict[str, Any]:
        """What all episodes share, by name."""
        return dict(zip(self.table.constants, self._constants(self.episodes[0]), strict=True))

    @property
    def world(self) -> str:
        """What a scene's number depends on, in words."""
        return self.table.world.format(**self.constants)

    @property
    def keys(self) -> list[EpisodeKey]:
        """Scenes and targets, sorted."""
        return sorted(self.evaluations[0].episodes)

    @property
    def episodes(self) -> list[Episode]:
        """All episodes, evaluation by evaluation, each in the order of `keys`."""
        return [evaluation.episodes[key] for evaluation in self.evaluations for key in self.keys]

    def only(self, keys: Collection[EpisodeKey]) -> "Run":
        """Return the run on some of its scenes and targets."""
        parts = (
            replace(evaluation, episodes={key: evaluation.episodes[key] for key in self.keys if key in keys})
            for evaluation in self.evaluations
        )
        return Run(label=self.label, evaluations=tuple(parts))
