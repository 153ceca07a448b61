"""What LeRobot keeps in `meta/` beside `info.json`: task descriptions, a row per episode, statistics."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import pyarrow.parquet as pq
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeInt, PositiveInt, TypeAdapter

from lerobot_excav.datasets.format.dataset_info import INFO_PATH, DatasetInfo
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.validated import validated_value
from lerobot_excav.errors import DatasetError

TASKS_PATH = Path("meta/tasks.parquet")
EPISODES_PATH = Path("meta/episodes")
STATISTICS_PATH = Path("meta/stats.json")


class VideoPlace(BaseModel):
    """Where an episode lies in the videos of a camera."""

    model_config = ConfigDict(strict=True, frozen=True)

    chunk_index: NonNegativeInt
    file_index: NonNegativeInt
    from_timestamp: Annotated[FiniteFloat, Field(ge=0.0)]


class EpisodeMetadata(BaseModel):
    """What LeRobot notes of an episode.

    Attributes:
        episode_index: Its number, which is its place among the rows as well.
        length: Number of frames.
        dataset_from_index: Row of the dataset at which it begins.
        dataset_to_index: Row at which the next one begins.
        tasks: Its task descriptions.
        chunk_index: Number of the folder of its frames.
        file_index: Number of the file of its frames.
        videos: Where its videos are, by key.
    """

    model_config = ConfigDict(strict=True, frozen=True)

    episode_index: NonNegativeInt
    length: PositiveInt
    dataset_from_index: NonNegativeInt
    dataset_to_index: NonNegativeInt
    tasks: Annotated[list[str], Field(min_length=1)]
    chunk_index: Annotated[NonNegativeInt, Field(alias="data/chunk_index")]
    file_index: Annotated[NonNegativeInt, Field(alias="data/file_index")]
    videos: dict[str, VideoPlace]


def read_episode_metadata(root: Path, info: DatasetInfo) -> list[EpisodeMetadata]:
    """Read the rows of all episodes, in the order in which LeRobot counts them.

    Raises:
        DatasetError: There is no file, one cannot be read, a row lacks something, or the rows are not numbered.
    """
    paths = sorted((root / EPISODES_PATH).glob("*/*.parquet"))
    if not paths:
        raise DatasetError(f"{root / EPISODES_PATH} is missing, or holds no Parquet file")
    episodes: list[EpisodeMetadata] = []
    for path in paths:
        with reading(path):
            parquet = pq.ParquetFile(path)
            known = [name for name in parquet.schema_arrow.names if not name.startswith("stats/")]
            rows = parquet.read(columns=known).to_pylist()
        for row in rows:
            number, values = len(episodes), {**row, "videos": _videos(row, info)}
            episode = validated_value(EpisodeMetadata, values, f"{path}: episode {number}")
            if episode.episode_index != number:
                raise DatasetError(f"{path}: episode_index={episode.episode_index} in the row of episode {number}")
            episodes.append(episode)
    if len(episodes) != info.total_episodes:
        counted = f"{root / INFO_PATH} counts {info.total_episodes}"
        raise DatasetError(f"{root / EPISODES_PATH} has {len(episodes)} episodes, but {counted}")
    return episodes


def _videos(row: dict[str, Any], info: DatasetInfo) -> dict[str, dict[str, Any]]:
    videos: dict[str, dict[str, Any]] = {key: {} for key in info.keys_of("video")}
    for name, value in row.items():
        parts = name.removeprefix("videos/").rsplit("/", 1)
        if name.startswith("videos/") and parts[0] in videos and len(parts) == 2:
            videos[parts[0]][parts[1]] = value
    return videos


def missing_files(root: Path, info: DatasetInfo, episodes: Sequence[EpisodeMetadata]) -> Iterator[str]:
    """Describe in plain words which of the files that episodes are in are missing.

    Raises:
        DatasetError: A pattern of `info.json` for their paths cannot be filled in.
    """
    files: dict[Path, int] = {}
    for episode in episodes:
        files.setdefault(info.data_file(root, episode.chunk_index, episode.file_index), episode.episode_index)
        for key, place in episode.videos.items():
            path = info.video_file(root, key, place.chunk_index, place.file_index)
            files.setdefault(path, episode.episode_index)
    for path, first in files.items():
        if not path.is_file():
            yield f"{path} is missing; meta/episodes names it for episode {first}"


def read_tasks(root: Path, info: DatasetInfo) -> list[str]:
    """Read the task descriptions, in the order of their numbers.

    Raises:
        DatasetError: The file is missing or damaged, or its tasks are not numbered in order.
    """
    path = root / TASKS_PATH
    with reading(path):
        table = pq.read_table(path).to_pandas()
        tasks: list[Any] = table.index.tolist()
        numbers = table["task_index"].tolist()
    if not all(isinstance(task, str) for task in tasks):
        raise DatasetError(f"{path} names no task: {tasks[:3]!r}")
    if len(set(tasks)) != len(tasks):
        raise DatasetError(f"{path} names a task twice")
    if numbers != list(range(len(tasks))) or len(tasks) != info.total_tasks:
        raise DatasetError(
            f"{path} has tasks with the numbers {numbers[:5]}, but {root / INFO_PATH} counts {info.total_tasks}"
        )
    return tasks


Statistics = dict[str, dict[str, Any]]


def read_statistics(root: Path) -> Statistics:
    """Read the statistics of all columns; what stands in them is not checked.

    Raises:
        DatasetError: The file is missing or damaged.
    """
    path = root / STATISTICS_PATH
    with reading(path):
        return TypeAdapter(Statistics).validate_json(path.read_bytes())
