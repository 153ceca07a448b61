"""Reading a dataset episode by episode, straight from its files (LeRobot's dataset format v3.0).

LeRobot's own reader first copies all pictures into a cache; what the index and the checks need is a small part of them.
"""

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.pictures import Pictures, StoredImages, VideoSpan
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.envs.tasks.selection import Schedule
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError

CODEBASE_VERSION = "v3.0"


@dataclass(frozen=True, kw_only=True)
class EpisodeTable:
    """Columns of one episode of a dataset.

    Attributes:
        index: Episode index.
        length: Number of frames.
        spec: Task of the robot that it was recorded with.
        columns: The columns asked for, by key, without pictures.
        pictures: The pictures asked for, by key, undecoded.
    """

    index: int
    length: int
    spec: TaskSpec
    columns: dict[str, pa.ChunkedArray]
    pictures: dict[str, Pictures]

    def array(self, key: str) -> NDArray[Any]:
        """Return a numeric column, shape (n, k) or (n,)."""
        return np.stack(self.columns[key].to_numpy())

    @property
    def state(self) -> NDArray[Any]:
        """What was felt of the machine, (n, s)."""
        return self.array(schema.STATE_KEY)

    @property
    def action(self) -> NDArray[Any]:
        """What the machine was told, (n, a)."""
        return self.array(schema.ACTION_KEY)

    @property
    def task_state(self) -> NDArray[Any]:
        """Task state, (n, k)."""
        return self.array(schema.TASK_STATE_KEY)

    @property
    def success(self) -> bool:
        """Outcome."""
        return bool(self._constant(schema.SUCCESS_KEY))

    @property
    def simulation_version(self) -> int:
        """Version of the simulation that the episode was recorded in."""
        return int(self._constant(schema.SIMULATION_KEY))

    @property
    def settings(self) -> dict[str, str]:
        """Settings that are kept in every frame, such as the soil, by name."""
        return {name: str(self._constant(schema.setting_key(name))) for name in self.spec.settings.columns()}

    @property
    def mask_words(self) -> str:
        """What the mask shows, in words."""
        return str(self._constant(schema.MASK_SOURCE_KEY))

    @property
    def mask_changes(self) -> frozenset[str]:
        """What was done to the mask of its source, in words: none if it is shown as the source made it."""
        return frozenset(self.mask_words.split(", ")[1:])

    @property
    def target_id(self) -> NDArray[Any]:
        """Target that is commanded, (n,)."""
        return self.array(schema.TARGET_KEY)

    @property
    def schedule(self) -> Schedule:
        """Changes of the command, as pairs of frame and target."""
        targets = self.target_id
        changes = (np.flatnonzero(np.diff(targets)) + 1).tolist()
        return tuple((frame, int(targets[frame])) for frame in changes)

    @property
    def pair(self) -> Pair:
        """Scene, and the target that is commanded first.

        Raises:
            DatasetError: The columns contradict each other.
        """
        pair = Pair.parse(self._constant(schema.PAIR_KEY))
        ids = (self._constant(schema.SCENE_KEY), int(self.target_id[0]))
        if pair.env != self.spec.env_type:
            raise DatasetError(
                f"episode {self.index}: {schema.PAIR_KEY}={pair.uid!r} is of {pair.env!r}, but the dataset's "
                f"robot_type is that of {self.spec.env_type!r}"
            )
        if ids != (pair.scene_id, pair.target_id):
            raise DatasetError(
                f"episode {self.index}: scene and first target {ids} contradict {schema.PAIR_KEY}={pair.uid!r}"
            )
        return pair

    def first_frame(self) -> "EpisodeTable":
        """Return a copy that holds the first frame only, so that the rest can be forgotten."""
        first = {
            key: pa.chunked_array([pa.array(column[:1].to_pylist(), column.type)])
            for key, column in self.columns.items()
        }
        pictures = {key: pictures.first() for key, pictures in self.pictures.items()}
        return replace(self, length=1, columns=first, pictures=pictures)

    def image(self, key: str, frame: int) -> NDArray[Any]:
        """Return a decoded picture, (H, W, 3) uint8."""
        return self.pictures[key].frame(frame)

    def image_digests(self, key: str) -> list[bytes]:
        """Return a digest of every picture; equal pictures of one writer have equal digests."""
        return self.pictures[key].digests()

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
        robot_type: Which robot it is of.
        video_path: Pattern of the paths of its videos; None if it has none.
    """

    fps: int
    total_episodes: int
    features: dict[str, Any]
    robot_type: str | None
    video_path: str | None

    @property
    def spec(self) -> TaskSpec:
        """Task of the robot that the dataset was recorded with; all tasks of a robot share its columns.

        Raises:
            DatasetError: It was recorded with another robot.
        """
        return task_of_robot(self.robot_type)


def read_info(root: Path) -> DatasetInfo:
    """Read what a dataset on disk says about itself.

    Raises:
        DatasetError: There is no dataset, or it has another format.
    """
    try:
        info = json.loads((root / "meta" / "info.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DatasetError(f"{root} is not a LeRobot dataset: it has no meta/info.json") from None
    if info["codebase_version"] != CODEBASE_VERSION:
        raise DatasetError(
            f"{root} has the format {info['codebase_version']}; this needs {CODEBASE_VERSION}, so convert it"
        )
    wanted = ("fps", "total_episodes", "features", "robot_type", "video_path")
    return DatasetInfo(**{name: info.get(name) for name in wanted})


def iterate_episodes(
    root: Path, keys: Sequence[str], *, episodes: Collection[int] | None = None
) -> Iterator[EpisodeTable]:
    """Go through a dataset's episodes, all by default, in the order of their files; frames come in order."""
    info = read_info(root)
    wanted = set(range(info.total_episodes) if episodes is None else episodes)
    stored = {kind: [key for key in keys if _dtype(info, key) == kind] for kind in ("image", "video")}
    spans = _video_spans(root, info, stored["video"])
    columns = [key for key in keys if key not in stored["video"]]
    for path in sorted(root.glob("data/*/*.parquet")):
        for index, rows in _episodes_of_file(path, columns, wanted):
            yield EpisodeTable(
                index=index,
                length=rows.num_rows,
                spec=info.spec,
                columns={key: rows[key] for key in columns if key not in stored["image"]},
                pictures={**{key: StoredImages(rows[key]) for key in stored["image"]}, **spans.get(index, {})},
            )


def _dtype(info: DatasetInfo, key: str) -> str:
    return str(info.features.get(key, {}).get("dtype", ""))


def _video_spans(root: Path, info: DatasetInfo, keys: Sequence[str]) -> dict[int, dict[str, VideoSpan]]:
    """Find where the videos of every episode lie."""
    if not keys or info.video_path is None:
        return {}
    parts = ("chunk_index", "file_index", "from_timestamp")
    columns = ["episode_index", "length", *(f"videos/{key}/{part}" for key in keys for part in parts)]
    spans: dict[int, dict[str, VideoSpan]] = {}
    for path in sorted(root.glob("meta/episodes/*/*.parquet")):
        for row in pq.read_table(path, columns=columns).to_pylist():
            for key in keys:
                chunk, file, start_s = (row[f"videos/{key}/{part}"] for part in parts)
                place = info.video_path.format(video_key=key, chunk_index=chunk, file_index=file)
                span = VideoSpan(path=root / place, start_s=start_s, fps=info.fps, length=row["length"])
                spans.setdefault(row["episode_index"], {})[key] = span
    return spans


def _episodes_of_file(path: Path, keys: Sequence[str], wanted: set[int]) -> Iterator[tuple[int, pa.Table]]:
    parquet = pq.ParquetFile(path)
    columns = list(dict.fromkeys([*keys, "episode_index", "frame_index"]))
    for group in range(parquet.num_row_groups):
        # LeRobot writes one row group per episode; a file written by something else just costs more memory.
        table = parquet.read_row_group(group, columns=columns)
        for index in pc.unique(table["episode_index"]).to_pylist():
            if index in wanted:
                rows = table.filter(pc.equal(table["episode_index"], index)).sort_by("frame_index")
                yield index, rows


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
