"""Whether frames, times and tasks of an episode are numbered as LeRobot finds them."""

from collections.abc import Iterator, Sequence

import numpy as np

from lerobot_excav.datasets.format.frame_files import EpisodeRows
from lerobot_excav.datasets.format.metadata import EpisodeMetadata
from lerobot_excav.datasets.format.pictures import TIME_TOLERANCE_S

KEYS = ("index", "timestamp", "task_index")
"""Columns that are checked, besides those that number episodes and frames."""


def numbering_problems(
    rows: EpisodeRows, *, fps: int, metadata: EpisodeMetadata | None, tasks: Sequence[str] | None
) -> Iterator[str]:
    """Describe in plain words what is wrong with the numbers of an episode.

    Args:
        rows: Its rows, with `KEYS`.
        fps: Frames per second.
        metadata: What `meta/episodes` says about it; None if that cannot be read, as of `tasks`.
        tasks: Task descriptions of the dataset.
    """
    length = rows.table.num_rows
    index, timestamp, task_index = (rows.table[key].to_numpy() for key in KEYS)
    if rows.first_row is not None and not np.array_equal(index, rows.first_row + np.arange(length)):
        wrong = int(np.argmax(index != rows.first_row + np.arange(length)))
        yield f"index is {index[wrong]} at frame {wrong}, which is row {rows.first_row + wrong} of the dataset"
    late = np.abs(timestamp - np.arange(length) / fps) > TIME_TOLERANCE_S
    if late.any():
        frame = int(np.argmax(late))
        yield f"timestamp is {timestamp[frame]:g} s at frame {frame}; {frame / fps:g} s are due at {fps} frames/s"
    if metadata is not None:
        yield from _metadata_problems(rows, metadata)
    if tasks is not None:
        unknown = sorted(set(task_index.tolist()) - set(range(len(tasks))))
        if unknown:
            yield f"task_index={unknown[0]} is not in meta/tasks.parquet, which has {len(tasks)} tasks"
        elif metadata is not None and {tasks[number] for number in task_index} != set(metadata.tasks):
            yield f"meta/episodes gives it the tasks {metadata.tasks}, which are not those of its frames"


def _metadata_problems(rows: EpisodeRows, metadata: EpisodeMetadata) -> Iterator[str]:
    length = rows.table.num_rows
    if metadata.length != length:
        yield f"has {length} frames, but meta/episodes gives it the length {metadata.length}"
    if rows.first_row is not None:
        noted = (metadata.dataset_from_index, metadata.dataset_to_index)
        found = (rows.first_row, rows.first_row + length)
        if noted != found:
            yield (
                f"has the rows {found[0]} to {found[1]}, but meta/episodes notes dataset_from_index={noted[0]} and "
                f"dataset_to_index={noted[1]}"
            )
