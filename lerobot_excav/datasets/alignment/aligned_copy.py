"""A copy of a recording in which every frame says how old what was seen was when its action was sent."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from lerobot.datasets.dataset_tools import add_features
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from lerobot_excav.datasets.alignment.noted_frames import NotedFrame, read_noted_frames
from lerobot_excav.errors import DatasetError, require

COLUMNS = {
    "excav.image_age_ms": "float32",
    "excav.state_age_ms": "float32",
    "excav.is_causal": "bool",
    "excav.is_as_told": "bool",
}
"""Columns and their types, in the order of `NotedFrame`."""


class AlignmentCounts(NamedTuple):
    """What is wrong with the frames of a recording."""

    frames: int
    late_frames: int  # what was seen was too old
    late_episodes: tuple[int, ...]
    other_frames: int  # the machine did something else than the action says
    worst_image_ms: float
    worst_state_ms: float


def write_aligned_copy(root: Path, out: Path, *, log: Path) -> AlignmentCounts:
    """Write a copy of a dataset with the columns `COLUMNS`, from the alignment log of its recording.

    Args:
        root: The dataset.
        out: The copy; must not exist.
        log: The robot's alignment log.

    Raises:
        ConfigurationError: `out` exists.
        DatasetError: There is no dataset, it has these columns already, or the log is that of another recording.
    """
    require(not out.exists(), f"--out={out} exists; choose another folder")
    if not (root / "meta" / "info.json").is_file():
        raise DatasetError(f"{root} is not a dataset; give the folder of one")
    noted = read_noted_frames(log)
    dataset = LeRobotDataset(f"local/{root.name}", root=root)
    if known := sorted(COLUMNS.keys() & dataset.features.keys()):
        raise DatasetError(f"{root} has {', '.join(known)} already")
    table = dataset.hf_dataset.with_format(None)
    episodes = [int(number) for number in table["episode_index"]]
    frames = [int(number) for number in table["frame_index"]]
    rows = [_row(noted.get(key), key, root, log) for key in zip(episodes, frames, strict=True)]
    columns = {
        name: (np.array([row[place] for row in rows], dtype), {"dtype": dtype, "shape": (1,), "names": None})
        for place, (name, dtype) in enumerate(COLUMNS.items())
    }
    add_features(dataset, columns, output_dir=out, repo_id=f"local/{out.name}")
    late = [episode for episode, row in zip(episodes, rows, strict=True) if not row.is_causal]
    return AlignmentCounts(
        frames=len(rows),
        late_frames=len(late),
        late_episodes=tuple(sorted(set(late))),
        other_frames=sum(not row.is_as_told for row in rows),
        worst_image_ms=max(row.image_age_ms for row in rows),
        worst_state_ms=max(row.state_age_ms for row in rows),
    )


def _row(noted: NotedFrame | None, key: tuple[int, int], root: Path, log: Path) -> NotedFrame:
    if noted is None:
        raise DatasetError(
            f"{log} says nothing of episode {key[0]}, frame {key[1]} of {root}; give the log that was written while "
            "this dataset was recorded"
        )
    return noted
