"""A copy of a recording in which every frame says how old what was seen was when its action was sent."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from lerobot.datasets.dataset_tools import add_features
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from lerobot_excav.datasets.alignment.noted_frames import NotedFrame, NotedFrames, read_noted_frames
from lerobot_excav.datasets.complete.exchange import copy_foreign_files, require_free, workspace
from lerobot_excav.datasets.format.alignment_columns import ALIGNMENT_COLUMNS
from lerobot_excav.datasets.format.dataset_info import INFO_PATH
from lerobot_excav.errors import DatasetError


class AlignmentCounts(NamedTuple):
    """What is wrong with the frames of a recording."""

    frames: int
    late_frames: int  # what was seen was too old
    late_episodes: tuple[int, ...]
    other_frames: int  # the machine did something else than the action says
    worst_image_ms: float
    worst_state_ms: float


def write_aligned_copy(root: Path, out: Path, *, log: Path) -> AlignmentCounts:
    """Write a copy of a dataset with the columns `ALIGNMENT_COLUMNS`, from the alignment log of its recording.

    Frames, videos, tasks and statistics of the dataset stay as they are, and so do files that LeRobot does not know.

    Args:
        root: The dataset.
        out: The copy; must not exist.
        log: The robot's alignment log.

    Raises:
        DatasetError: `out` exists, there is no dataset, it has these columns already, or the log is that of another
            recording.
    """
    require_free(out)
    info = _read_info(root)
    if known := sorted(ALIGNMENT_COLUMNS.keys() & info["features"].keys()):
        raise DatasetError(f"{root} has {', '.join(known)} already")
    noted = read_noted_frames(log)
    dataset = LeRobotDataset(f"local/{root.name}", root=root)
    rows = _rows_of(dataset, noted, root, log)
    columns = {
        name: (np.array([row[place] for _, row in rows], dtype), {"dtype": dtype, "shape": (1,), "names": None})
        for place, (name, dtype) in enumerate(ALIGNMENT_COLUMNS.items())
    }
    with workspace(beside=out) as folder:
        add_features(dataset, columns, output_dir=folder / "dataset", repo_id=f"local/{out.name}")
        copy_foreign_files(root, folder / "dataset")
        (folder / "dataset").rename(out)
    return _counts(rows)


def _read_info(root: Path) -> dict[str, Any]:
    """Return what `meta/info.json` says, of a dataset of any robot.

    Raises:
        DatasetError: There is none, or it is damaged.
    """
    path = root / INFO_PATH
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
        info["features"].keys()
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise DatasetError(f"{path} cannot be read ({error!r}); give the folder of a dataset") from error
    return dict(info)


def _rows_of(dataset: LeRobotDataset, noted: NotedFrames, root: Path, log: Path) -> list[tuple[int, NotedFrame]]:
    """Return episode and notes of every frame; the log has to tell of just as many frames of every episode."""
    episodes = [int(number) for number in dataset.hf_dataset.with_format(None)["episode_index"]]
    lengths = Counter(episodes)
    unlike = [index for index, length in lengths.items() if len(noted.get(index, ())) != length]
    # The last one may have been begun and thrown away.
    beyond = [index for index in noted if index > len(lengths)]
    if unlike or beyond:
        index = (unlike or beyond)[0]
        raise DatasetError(
            f"{log} tells of {len(noted.get(index, ()))} frames of episode {index}, and {root} has {lengths[index]}; "
            "give the log that was written while this dataset was recorded, and only then"
        )
    return [(index, row) for index in sorted(lengths) for row in noted[index]]


def _counts(rows: Sequence[tuple[int, NotedFrame]]) -> AlignmentCounts:
    late = [episode for episode, row in rows if not row.is_causal]
    return AlignmentCounts(
        frames=len(rows),
        late_frames=len(late),
        late_episodes=tuple(sorted(set(late))),
        other_frames=sum(not row.is_as_told for _, row in rows),
        worst_image_ms=max(row.image_age_ms for _, row in rows),
        worst_state_ms=max(row.state_age_ms for _, row in rows),
    )
