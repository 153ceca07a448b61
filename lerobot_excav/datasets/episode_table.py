"""Reading a dataset episode by episode, straight from its files (LeRobot's dataset format v3.0).

LeRobot's own reader first copies all pictures into a cache; what the index and the checks need is a small part of them.
"""

import io
import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.datasets.pair import Pair
from lerobot_excav.datasets.schema import (
    ACTION_KEY,
    FIDELITY_KEY,
    PAIR_KEY,
    SCENE_KEY,
    SIMULATION_KEY,
    SOIL_KEY,
    STATE_KEY,
    SUCCESS_KEY,
    TARGET_KEY,
    TASK_STATE_KEY,
    UNMARKED,
)
from lerobot_excav.errors import DatasetError

CODEBASE_VERSION = "v3.0"


@dataclass(frozen=True, kw_only=True)
class EpisodeTable:
    """Columns of one episode of a dataset.

    Attributes:
        index: Episode index.
        length: Number of frames.
        columns: The columns asked for, by key; pictures are undecoded.
    """

    index: int
    length: int
    columns: dict[str, pa.ChunkedArray]

    def array(self, key: str) -> NDArray[Any]:
        """Return a numeric column, shape (n, k) or (n,)."""
        return np.stack(self.columns[key].to_numpy())

    @property
    def state(self) -> NDArray[Any]:
        """Joint positions and velocities, (n, 8)."""
        return self.array(STATE_KEY)

    @property
    def action(self) -> NDArray[Any]:
        """Joystick commands, (n, 4)."""
        return self.array(ACTION_KEY)

    @property
    def task_state(self) -> NDArray[Any]:
        """Task state, (n, 8)."""
        return self.array(TASK_STATE_KEY)

    @property
    def success(self) -> bool:
        """Outcome."""
        return bool(self._constant(SUCCESS_KEY))

    @property
    def simulation_version(self) -> int:
        """Version of the simulation that the episode was recorded in."""
        return int(self._constant(SIMULATION_KEY))

    @property
    def soil(self) -> str:
        """Name of the soil preset."""
        return str(self._constant(SOIL_KEY))

    @property
    def fidelity(self) -> str:
        """Numerical effort of the soil."""
        return str(self._constant(FIDELITY_KEY))

    @property
    def pair(self) -> Pair:
        """Scene and target.

        Raises:
            DatasetError: The columns contradict each other.
        """
        pair = Pair.parse(self._constant(PAIR_KEY))
        ids = (self._constant(SCENE_KEY), self._constant(TARGET_KEY))
        if ids != (pair.scene_id, pair.target_id):
            raise DatasetError(
                f"episode {self.index}: scene and target {ids} contradict {PAIR_KEY}={pair.uid!r}"
            )
        return pair

    def first_frame(self) -> "EpisodeTable":
        """Return a copy that holds the first frame only, so that the rest can be forgotten."""
        first = {
            key: pa.chunked_array([pa.array(column[:1].to_pylist(), column.type)])
            for key, column in self.columns.items()
        }
        return EpisodeTable(index=self.index, length=1, columns=first)

    def image(self, key: str, frame: int) -> NDArray[Any]:
        """Return a decoded picture, (H, W, 3) uint8."""
        return np.asarray(Image.open(io.BytesIO(self.columns[key][frame]["bytes"].as_py())).convert("RGB"))

    def distinct_images(self, key: str) -> int:
        """Count pictures that differ in their file bytes; equal pictures of one writer have equal bytes."""
        return len({value["bytes"].as_py() for value in self.columns[key]})

    def _constant(self, key: str) -> Any:
        values = pc.unique(self.columns[key]).to_pylist()
        if len(values) != 1:
            raise DatasetError(
                f"episode {self.index}: {key} changes within the episode: {values[:3]}; it names the whole episode"
            )
        return values[0]


@dataclass(frozen=True, kw_only=True)
class DatasetInfo:
    """What `meta/info.json` says.

    Attributes:
        fps: Frames per second.
        total_episodes: Number of episodes.
        features: Feature descriptions by key.
    """

    fps: int
    total_episodes: int
    features: dict[str, Any]


def read_info(root: Path) -> DatasetInfo:
    """Read what a dataset on disk says about itself.

    Raises:
        DatasetError: There is no dataset, or it has another format.
    """
    try:
        info = json.loads((root / "meta" / "info.json").read_text())
    except FileNotFoundError:
        raise DatasetError(f"{root} is not a LeRobot dataset: it has no meta/info.json") from None
    if info["codebase_version"] != CODEBASE_VERSION:
        raise DatasetError(
            f"{root} has the format {info['codebase_version']}; this needs {CODEBASE_VERSION}, so convert it"
        )
    return DatasetInfo(fps=info["fps"], total_episodes=info["total_episodes"], features=info["features"])


def iterate_episodes(
    root: Path, keys: Sequence[str], *, episodes: Collection[int] | None = None
) -> Iterator[EpisodeTable]:
    """Go through a dataset's episodes in the order of their files.

    Args:
        root: The dataset.
        keys: Columns to read. Those of `schema.UNMARKED` that a dataset lacks are filled in.
        episodes: Episode indices; all by default.

    Yields:
        One table per episode, frames in order.
    """
    wanted = set(range(read_info(root).total_episodes) if episodes is None else episodes)
    for path in sorted(root.glob("data/*/*.parquet")):
        yield from _episodes_of_file(path, keys, wanted)


def _episodes_of_file(path: Path, keys: Sequence[str], wanted: set[int]) -> Iterator[EpisodeTable]:
    parquet = pq.ParquetFile(path)
    columns = list(dict.fromkeys([*keys, "episode_index", "frame_index"]))
    for group in range(parquet.num_row_groups):
        # LeRobot writes one row group per episode; a file written by something else just costs more memory.
        table = _marked(parquet.read_row_group(group, columns=columns), columns)
        for index in pc.unique(table["episode_index"]).to_pylist():
            if index in wanted:
                rows = table.filter(pc.equal(table["episode_index"], index)).sort_by("frame_index")
                yield EpisodeTable(
                    index=index, length=rows.num_rows, columns={key: rows[key] for key in keys}
                )


def _marked(table: pa.Table, columns: Sequence[str]) -> pa.Table:
    """Fill in columns that were asked for and that the first version of the simulation did not write."""
    for key, value in UNMARKED.items():
        if key in columns and key not in table.column_names:
            table = table.append_column(key, pa.array([value] * table.num_rows))
    return table


def require_single_task(root: Path, episodes: Collection[int]) -> None:
    """Check that `lerobot-train` can hold out exactly the episodes it is told to; it splits task by task.

    Raises:
        DatasetError: The episodes have several task descriptions.
    """
    tasks = {
        index
        for table in iterate_episodes(root, ["task_index"], episodes=episodes)
        for index in table.array("task_index")
    }
    if len(tasks) > 1:
        raise DatasetError(
            f"the chosen episodes have {len(tasks)} task descriptions, and lerobot-train splits each of them apart; "
            "give them one with `lerobot-edit-dataset --operation.type=modify_tasks`, or train without --split"
        )
