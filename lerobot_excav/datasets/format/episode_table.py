"""Reading a dataset episode by episode, straight from its files (LeRobot's dataset format v3.0).

LeRobot's own reader first copies all pictures into a cache; what the index and the checks need is a small part of them.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from lerobot_excav.datasets.format import schema
from lerobot_excav.datasets.format.dataset_info import INFO_PATH, DatasetInfo, read_info
from lerobot_excav.datasets.format.frame_files import EpisodeRows, Report, iterate_rows, raise_damage
from lerobot_excav.datasets.format.metadata import EpisodeMetadata, read_episode_metadata
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.pictures import Pictures, StoredImages, VideoSpan
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.envs.tasks.selection import Schedule
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError


@dataclass(frozen=True, kw_only=True)
class EpisodeTable:
    """Columns of one episode of a dataset.

    Attributes:
        index: Episode index.
        length: Number of frames.
        robot: First task of the robot that it was recorded with; all tasks of a robot share its columns.
        columns: The columns asked for, by key, without pictures.
        pictures: The pictures asked for, by key, undecoded.
    """

    index: int
    length: int
    robot: TaskSpec
    columns: dict[str, pa.ChunkedArray]
    pictures: dict[str, Pictures]

    def array(self, key: str) -> NDArray[Any]:
        """Return a numeric column, shape (n, k) or (n,)."""
        return np.stack(self.columns[key].to_numpy())

    @property
    def spec(self) -> TaskSpec:
        """Task that it plays.

        Raises:
            DatasetError: The robot has no such task.
        """
        task_id = str(self._constant(schema.TASK_KEY))
        try:
            return task_of_robot(self.robot.robot_type, task_id)
        except DatasetError as unknown:
            raise DatasetError(f"episode {self.index}: {unknown}") from None

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
    def outcome(self) -> NDArray[Any]:
        """Task state at the end of the episode, (k,)."""
        outcomes = self.array(schema.OUTCOME_KEY)
        if (outcomes != outcomes[0]).any():
            raise DatasetError(
                f"episode {self.index}: {schema.OUTCOME_KEY} changes within the episode; it names the whole episode"
            )
        return np.asarray(outcomes[0])

    @property
    def rest_frames(self) -> int:
        """How many frames the machine was held still after the last one."""
        return int(self._constant(schema.REST_KEY))

    @property
    def operator(self) -> str:
        """Who commanded, one of `OPERATORS`."""
        return str(self._constant(schema.OPERATOR_KEY))

    @property
    def intervention(self) -> NDArray[Any]:
        """Whether a person took over from the policy, (n,)."""
        return self.array(schema.INTERVENTION_KEY)

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
        """Changes of the command, as pairs of frame and target; another region may have the same number."""
        targets = self.target_id
        changes = (np.flatnonzero(np.diff(self.array(schema.COMMAND_KEY))) + 1).tolist()
        return tuple((frame, int(targets[frame])) for frame in changes)

    @property
    def pair(self) -> Pair:
        """Scene, stage, and the target that is commanded first.

        Raises:
            DatasetError: The columns contradict each other.
        """
        pair = Pair.parse(self._constant(schema.PAIR_KEY))
        ids = (self._constant(schema.SCENE_KEY), self._constant(schema.STAGE_KEY), int(self.target_id[0]))
        if pair.env != self.robot.env_type:
            raise DatasetError(
                f"episode {self.index}: {schema.PAIR_KEY}={pair.uid!r} is of {pair.env!r}, but the dataset's "
                f"robot_type is that of {self.robot.env_type!r}"
            )
        if ids != (pair.scene_id, pair.stage, pair.target_id):
            raise DatasetError(
                f"episode {self.index}: scene, stage and first target {ids} contradict {schema.PAIR_KEY}={pair.uid!r}"
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
        """Return a decoded picture, (H, W, 3) uint8.

        Raises:
            DatasetError: It is damaged.
        """
        try:
            return self.pictures[key].frame(frame)
        except DatasetError as damage:
            raise DatasetError(f"episode {self.index}: {key}: {damage}") from damage

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


def iterate_episodes(
    root: Path,
    keys: Sequence[str],
    *,
    episodes: Collection[int] | None = None,
    report: Report = raise_damage,
) -> Iterator[EpisodeTable]:
    """Go through a dataset's episodes in the order of their files; frames come in order.

    Args:
        root: The dataset.
        keys: Columns and pictures to read.
        episodes: Episodes to read; all by default.
        report: What is done about files that cannot be read, see `iterate_rows`.

    Raises:
        DatasetError: A file or a column of what is asked for is missing, damaged or of another kind than declared.
    """
    info = read_info(root)
    undeclared = [key for key in keys if key not in info.features]
    if undeclared:
        raise DatasetError(f"{root / INFO_PATH} declares no {', '.join(undeclared)}")
    videos = [key for key in keys if key in info.keys_of("video")]
    metadata = read_episode_metadata(root, info) if videos else []
    stored = [key for key in keys if key not in videos]
    for rows in iterate_rows(root, info, stored, episodes=episodes, report=report):
        if rows.problems:
            raise DatasetError(f"episode {rows.index}: {'; '.join(rows.problems)}")
        yield episode_table(root, info, rows, metadata[rows.index] if videos else None, keys)


def episode_table(
    root: Path, info: DatasetInfo, rows: EpisodeRows, metadata: EpisodeMetadata | None, keys: Sequence[str]
) -> EpisodeTable:
    """Make the table of an episode from rows that have no problems; without metadata it has no videos."""
    pictures: dict[str, Pictures] = {
        key: StoredImages(rows.table[key], info.size_of(key)) for key in keys if key in info.keys_of("image")
    }
    for key, place in metadata.videos.items() if metadata else ():
        if key in keys:
            pictures[key] = VideoSpan(
                path=info.video_file(root, key, place.chunk_index, place.file_index),
                start_s=place.from_timestamp,
                fps=info.fps,
                length=rows.table.num_rows,
                size=info.size_of(key),
            )
    return EpisodeTable(
        index=rows.index,
        length=rows.table.num_rows,
        robot=info.spec,
        columns={key: rows.table[key] for key in keys if key in rows.table.column_names and key not in pictures},
        pictures=pictures,
    )


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
