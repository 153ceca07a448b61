"""How the evaluations of a task are read, compared and tabulated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto

from lerobot_excav.evaluation.episode import Episode


class Kind(Enum):
    """How a column sums up episodes."""

    RATE = auto()
    """Share of the episodes with a truth value that is true; Wilson interval over these episodes."""
    MEAN = auto()
    """Mean; bootstrap interval over scenes and targets."""
    RATIO = auto()
    """Mean over the operator's on the same scenes and targets; bootstrap interval."""
    COUNTS = auto()
    """How often each word occurs."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One measure of a task.

    Attributes:
        key: Name in `report.json`.
        header: Name in tables.
        kind: How episodes are summed up.
        field: Field or property of the task's `Episode`; None leaves an episode out of a rate.
        words: For counts, all words in the order of the table.
    """

    key: str
    header: str
    kind: Kind
    field: str
    words: tuple[str, ...] = ()

    @property
    def scale(self) -> float:
        """Factor to the unit of the header: shares are shown in percent."""
        return 100.0 if self.kind in (Kind.RATE, Kind.RATIO) else 1.0


@dataclass(frozen=True, kw_only=True)
class TaskTable:
    """Everything that reports know of a task.

    Attributes:
        task: The task, as metrics files name it.
        episode: What a line holds.
        constants: Fields that all episodes of a run share, with their plural for messages.
        setting: Headers and fields of the columns that tell runs apart.
        columns: The measures.
        compared: Keys of the measures whose paired differences are given.
        world: What two runs must share for a scene's number to mean the same scene, as text with fields in braces.
        simulation: Description of the simulation, as text with fields in braces.
        legend: Explains the columns, line by line; takes who the operator was, None without one.
    """

    task: str
    episode: type[Episode]
    constants: Mapping[str, str]
    setting: Mapping[str, str]
    columns: tuple[Column, ...]
    compared: tuple[str, ...]
    world: str
    simulation: str
    legend: Callable[[str | None], list[str]]

    def column(self, key: str) -> Column:
        """Return a column by its key."""
        return next(column for column in self.columns if column.key == key)
