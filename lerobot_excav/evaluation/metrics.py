"""What was measured in an evaluation: one line of JSON per episode, as `--env.metrics_path` writes it."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_args

from lerobot_excav.datasets.format.json_lines import Line, read_json_lines
from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.episode import Episode, EpisodeKey
from lerobot_excav.evaluation.grasp_table import GRASP
from lerobot_excav.evaluation.scoop_table import SCOOP
from lerobot_excav.evaluation.task_table import TaskTable

TASK_TABLES = {table.task: table for table in (SCOOP, GRASP)}
"""Every task that reports are made of."""

UNMARKED_TASK = SCOOP.task
"""The task of the files that were written when there was one only."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """One evaluation, from one metrics file.

    Attributes:
        path: The file.
        table: What reports know of its task.
        of: How many evaluations the file holds; LeRobot appends one after the other, and this is the last.
        operator: Who played, if the file says so: `scripted`, `human`, or None for a policy.
        seed: Seed of the first episode; LeRobot's `--seed`. None if the file does not say.
        episodes: Outcomes by scene and target.
    """

    path: Path
    table: TaskTable
    of: int
    operator: str | None
    seed: int | None
    episodes: dict[EpisodeKey, Episode]


def read_evaluation(path: Path) -> Evaluation:
    """Read the last evaluation of a metrics file.

    Args:
        path: The file, or a folder with `metrics.jsonl` in it.

    Raises:
        DatasetError: The file is missing, empty or damaged, a field is missing or of another type, a task is unknown
            or tasks are mixed, or an episode occurs twice.
    """
    path = path / "metrics.jsonl" if path.is_dir() else path
    lines = read_json_lines(path, origin=f"lerobot-eval writes it with --env.metrics_path={path}")
    if not lines:
        raise DatasetError(f"{path} is empty: no episode was finished")
    evaluations = _evaluations(lines)
    last = evaluations[-1]
    table = _table(last)
    return Evaluation(
        path=path,
        table=table,
        of=len(evaluations),
        operator=last[0].record.get("operator"),
        seed=last[0].record.get("seed"),
        episodes=_by_key(last, table),
    )


def _evaluations(lines: list[Line]) -> list[list[Line]]:
    """Cut a file where LeRobot began to count anew."""
    starts = [i for i, line in enumerate(lines) if i == 0 or line.record.get("episode_ix") == 0]
    return [lines[a:b] for a, b in zip(starts, [*starts[1:], len(lines)], strict=True)]


def _table(lines: list[Line]) -> TaskTable:
    first = lines[0].record.get("task", UNMARKED_TASK)
    for line in lines:
        task = line.record.get("task", UNMARKED_TASK)
        if task not in TASK_TABLES:
            raise DatasetError(
                f"{line.place}: task={task!r}; reports are made of {', '.join(TASK_TABLES)} only"
            )
        if task != first:
            raise DatasetError(f"{line.place}: task={task!r}, but the lines before are of {first!r}")
    return TASK_TABLES[first]


def _by_key(lines: Iterable[Line], table: TaskTable) -> dict[EpisodeKey, Episode]:
    episodes: dict[EpisodeKey, Episode] = {}
    for line in lines:
        episode = _episode(line, table)
        if episode.key in episodes:
            raise DatasetError(
                f"{line.place}: scene and target {episode.key} occur twice; are these two evaluations?"
            )
        episodes[episode.key] = episode
    return episodes


def _episode(line: Line, table: TaskTable) -> Episode:
    record = table.episode.completed(line.record)
    values: dict[str, Any] = {}
    for field in fields(table.episode):
        if field.name not in record:
            raise DatasetError(f"{line.place}: lacks {field.name}; was it written by --env.metrics_path?")
        values[field.name] = _typed(record[field.name], field.type, f"{line.place}: {field.name}")
    return table.episode(**values)


def _typed(value: Any, kind: Any, place: str) -> Any:
    """Check a JSON value against a type; whole numbers are numbers, but truth values are not."""
    if kinds := get_args(kind):  # `int | None`
        kind = kinds[0]
        if value is None:
            return None
    fits = {
        bool: isinstance(value, bool),
        str: isinstance(value, str),
        int: isinstance(value, int) and not isinstance(value, bool),
        float: isinstance(value, int | float) and not isinstance(value, bool),
    }[kind]
    if not fits:
        raise DatasetError(f"{place}={value!r} is no {kind.__name__}")
    return kind(value)
