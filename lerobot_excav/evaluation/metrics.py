"""What was measured in an evaluation: one line of JSON per episode, as `--env.metrics_path` writes it."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated
from lerobot_excav.envs.tasks.measures import EpisodeKey, EpisodeRecord, TaskMeasures
from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.errors import ConfigurationError, DatasetError


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """One evaluation, from one metrics file.

    Attributes:
        path: The file.
        task: Its task.
        measures: What is measured of the task.
        of: How many evaluations the file holds; LeRobot appends one after the other, and this is the last.
        operator: Who played, if the file says so: `scripted`, `person`, or None for a policy.
        seed: Seed of the first episode; LeRobot's `--seed`. None if the file does not say.
        episodes: Outcomes by scene, stage and target.
    """

    path: Path
    task: str
    measures: TaskMeasures
    of: int
    operator: str | None
    seed: int | None
    episodes: dict[EpisodeKey, EpisodeRecord]


class _LineHead(BaseModel):
    """The entries of a line that are not the outcome of the episode."""

    model_config = ConfigDict(strict=True)

    task: str
    evaluation: str | None = None
    episode_ix: int | None = None
    operator: str | None = None
    seed: int | None = None


class _Line(NamedTuple):
    place: str
    text: str
    head: _LineHead


def read_evaluation(path: Path) -> Evaluation:
    """Read the last evaluation of a metrics file.

    Args:
        path: The file, or a folder with `metrics.jsonl` in it.

    Raises:
        DatasetError: The file is missing, empty or damaged, a field is missing or of another type, a task is unknown
            or tasks are mixed, an episode occurs twice, or evaluations wrote into the file at the same time.
    """
    path = path / "metrics.jsonl" if path.is_dir() else path
    evaluations = _cut(_lines(path), path)
    last = evaluations[-1]
    head = last[0].head
    measures = _measures(last)
    return Evaluation(
        path=path,
        task=head.task,
        measures=measures,
        of=len(evaluations),
        operator=head.operator,
        seed=head.seed,
        episodes=_by_key(last, measures),
    )


def _lines(path: Path) -> list[_Line]:
    try:
        texts = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise DatasetError(f"{path} is not a metrics file: {error}") from error
    except FileNotFoundError:
        raise DatasetError(f"{path} does not exist; lerobot-eval writes it with --env.metrics_path={path}") from None
    places = [(f"{path}:{number}", text) for number, text in enumerate(texts, 1) if text.strip()]
    if not places:
        raise DatasetError(f"{path} is empty: no episode was finished")
    return [_Line(place, text, validated(_LineHead, text, place)) for place, text in places]


def _cut(lines: list[_Line], path: Path) -> list[list[_Line]]:
    """Cut a file where another evaluation begins: its lines are named otherwise, or LeRobot counts from 0 again.

    Raises:
        DatasetError: The lines of an evaluation do not stand together, or not in order.
    """
    heads = [line.head for line in lines]
    changes = [i for i in range(1, len(lines)) if heads[i].evaluation != heads[i - 1].evaluation]
    starts = sorted({0, *changes, *(i for i, head in enumerate(heads) if head.episode_ix == 0)})
    parts = [lines[a:b] for a, b in zip(starts, [*starts[1:], len(lines)], strict=True)]
    seen: set[str] = set()
    for part in parts:
        name = part[0].head.evaluation
        numbers = [line.head.episode_ix for line in part if line.head.episode_ix is not None]
        if name in seen or any(a >= b for a, b in pairwise(numbers)):
            key = f'"evaluation": "{name}"'
            raise DatasetError(
                f"{part[0].place}: evaluations wrote into {path} at the same time; give each a metrics_path of its own"
                + (f". To have the lines of this one: grep '{key}' {path} > OTHER.jsonl" if name else "")
            )
        seen |= {name} if name else set()
    return parts


def _measures(lines: list[_Line]) -> TaskMeasures:
    first = lines[0]
    for line in lines:
        if line.head.task != first.head.task:
            raise DatasetError(
                f"{line.place}: task={line.head.task!r}, but the lines before are of {first.head.task!r}"
            )
    try:
        return task_spec(f"{first.place}: task", first.head.task).measures
    except ConfigurationError as error:
        raise DatasetError(str(error)) from error


def _by_key(lines: list[_Line], measures: TaskMeasures) -> dict[EpisodeKey, EpisodeRecord]:
    episodes: dict[EpisodeKey, EpisodeRecord] = {}
    for line in lines:
        episode = validated(measures.record, line.text, line.place)
        if episode.key in episodes:
            raise DatasetError(
                f"{line.place}: scene, stage and target {episode.key} occur twice; are these two evaluations?"
            )
        episodes[episode.key] = episode
    return episodes
