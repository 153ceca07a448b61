"""The rows of a dataset episode by episode, in the order of its files, which is the order that LeRobot knows."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from lerobot_excav.datasets.format.columns import NUMBERING_KEYS, row_problems, schema_problems
from lerobot_excav.datasets.format.dataset_info import INFO_PATH, DatasetInfo
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.schema import require_numbering
from lerobot_excav.errors import DatasetError

Report = Callable[[DatasetError], None]
"""What is done about damage: raise it, or note it, and then the rest is read."""


@dataclass(frozen=True, kw_only=True)
class EpisodeRows:
    """The rows of one episode.

    Attributes:
        index: Episode index.
        path: File of the first row.
        first_row: How many rows of the dataset stand before it; None where a file before it cannot be read.
        table: The columns that were asked for.
        problems: What is wrong with them, in plain words.
    """

    index: int
    path: Path
    first_row: int | None
    table: pa.Table
    problems: list[str]


def raise_damage(damage: DatasetError) -> None:
    """Raise what is told: the damage is not to be worked around."""
    raise damage


def frame_files(root: Path) -> list[Path]:
    """Return the files of frames: all that LeRobot takes for one, hidden ones included."""
    return sorted(root.glob("data/*/*.parquet"))


def iterate_rows(
    root: Path,
    info: DatasetInfo,
    keys: Sequence[str],
    *,
    episodes: Collection[int] | None = None,
    report: Report = raise_damage,
) -> Iterator[EpisodeRows]:
    """Go through the rows of a dataset's episodes.

    Args:
        root: The dataset.
        info: What it says about itself.
        keys: Columns to read; those that number the rows are read besides.
        episodes: Episodes to read; all by default.
        report: Is told of every file or row group that cannot be read or lacks columns, and of episodes that are
            missing or torn apart. It raises by default; where it returns, what is damaged is left out.
    """
    require_numbering(info.features)
    columns = list(dict.fromkeys([*keys, *NUMBERING_KEYS]))
    groups = _row_groups(frame_files(root), info, columns, episodes, report)
    seen: set[int] = set()
    for run in _runs(groups):
        if run.index in seen:
            report(DatasetError(f"{run.path}: the rows of episode {run.index} lie apart"))
        elif not 0 <= run.index < info.total_episodes:
            total = info.total_episodes
            report(DatasetError(f"{run.path} has an episode {run.index}, but {root / INFO_PATH} counts {total}"))
        elif episodes is None or run.index in episodes:
            rows = _attempt(report, run.path, partial(_episode_rows, run, info, columns))
            if rows is not None:
                yield rows
        seen.add(run.index)
    found = sum(0 <= index < info.total_episodes for index in seen)
    if missing := info.total_episodes - found:
        total = info.total_episodes
        report(DatasetError(f"{root / INFO_PATH} counts {total} episodes; {missing} of them have no frames in data/"))


@dataclass(frozen=True, kw_only=True)
class _RowGroup:
    """A row group: the episode of every row, and its columns if one of them is wanted."""

    path: Path
    first_row: int | None
    numbers: NDArray[Any]
    table: pa.Table | None


@dataclass(frozen=True, kw_only=True)
class _Run:
    """Neighbouring rows of one episode, from one or several row groups; no table where no episode is wanted."""

    index: int
    path: Path
    first_row: int | None
    tables: list[pa.Table] = field(default_factory=list)


def _attempt[Result](report: Report, what: Path | str, read: Callable[[], Result]) -> Result | None:
    try:
        with reading(what):
            return read()
    except DatasetError as damage:
        report(damage)
        return None


def _row_groups(
    paths: Iterable[Path], info: DatasetInfo, columns: Sequence[str], wanted: Collection[int] | None, report: Report
) -> Iterator[_RowGroup]:
    first_row: int | None = 0
    for path in paths:
        parquet = _attempt(report, path, partial(pq.ParquetFile, path))
        if parquet is None:
            first_row = None
            continue
        problems = list(schema_problems(parquet.schema_arrow, info.features, columns))
        for problem in problems:
            report(DatasetError(f"{path}: {problem}"))
        for group in range(parquet.num_row_groups):
            if not problems:
                read = partial(_read_group, parquet, group, columns, wanted)
                found = _attempt(report, f"{path}, row group {group},", read)
                if found is not None:
                    yield _RowGroup(path=path, first_row=first_row, numbers=found[0], table=found[1])
            if first_row is not None:
                first_row += parquet.metadata.row_group(group).num_rows


def _read_group(
    parquet: pq.ParquetFile, group: int, columns: Sequence[str], wanted: Collection[int] | None
) -> tuple[NDArray[Any], pa.Table | None]:
    """Return the episode of every row, and the columns; pictures are large, so of wanted episodes only."""
    numbers = parquet.read_row_group(group, columns=["episode_index"])["episode_index"]
    if numbers.null_count:
        raise DatasetError(f"episode_index is null in row group {group}")
    is_wanted = wanted is None or any(number in wanted for number in numbers.unique().to_pylist())
    return numbers.to_numpy(), parquet.read_row_group(group, columns=list(columns)) if is_wanted else None


def _runs(groups: Iterable[_RowGroup]) -> Iterator[_Run]:
    """Join the rows of an episode that stand side by side, also across row groups: LeRobot writes one per episode."""
    run: _Run | None = None
    for group in groups:
        bounds = [0, *(np.flatnonzero(np.diff(group.numbers)) + 1).tolist(), len(group.numbers)]
        for start, end in pairwise(bounds if len(group.numbers) else []):
            index = int(group.numbers[start])
            if run is None or run.index != index:
                if run is not None:
                    yield run
                first_row = None if group.first_row is None else group.first_row + start
                run = _Run(index=index, path=group.path, first_row=first_row)
            if group.table is not None:
                run.tables.append(group.table.slice(start, end - start))
    if run is not None:
        yield run


def _episode_rows(run: _Run, info: DatasetInfo, columns: Sequence[str]) -> EpisodeRows:
    table = pa.concat_tables(run.tables, promote_options="permissive")
    problems = list(row_problems(table, info.features, columns))
    return EpisodeRows(index=run.index, path=run.path, first_row=run.first_row, table=table, problems=problems)
