"""What a dataset says about itself in `meta/info.json`."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, NonNegativeInt, PositiveFloat, PositiveInt

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.schema import Feature
from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError

CODEBASE_VERSION = "v3.0"
INFO_PATH = Path("meta/info.json")
PICTURE_DTYPES = ("image", "video")


def _this_format(version: str) -> str:
    if version != CODEBASE_VERSION:
        raise ValueError(f"has the format {version}; this needs {CODEBASE_VERSION}, so convert it")
    return version


def _with_size(feature: Feature) -> Feature:
    shape = feature["shape"]
    if feature["dtype"] in PICTURE_DTYPES and (len(shape) != 3 or not {1, 3} & {shape[0], shape[2]}):
        raise ValueError(f"shape={shape} is not that of a picture; allowed is [height, width, 3], or 1 of depth")
    return feature


class DatasetInfo(BaseModel):
    """The part of the file that LeRobot and this package need; unknown fields are left out, as LeRobot does.

    Attributes:
        codebase_version: Version of the format.
        fps: Frames per second.
        total_episodes: Number of episodes.
        total_frames: Number of frames.
        total_tasks: Number of task descriptions.
        chunks_size: Most files in a folder.
        data_files_size_in_mb: Size from which on another file of frames is begun.
        video_files_size_in_mb: Size from which on another video is begun.
        features: Feature descriptions by key.
        robot_type: Which robot it is of.
        data_path: Pattern of the paths of its frames.
        video_path: Pattern of the paths of its videos; None if it has none.
    """

    model_config = ConfigDict(strict=True, frozen=True)

    codebase_version: Annotated[str, AfterValidator(_this_format)]
    fps: PositiveInt
    total_episodes: NonNegativeInt
    total_frames: NonNegativeInt
    total_tasks: NonNegativeInt
    chunks_size: PositiveInt = 1000
    data_files_size_in_mb: PositiveFloat = 100
    video_files_size_in_mb: PositiveFloat = 200
    features: Annotated[dict[str, Annotated[Feature, AfterValidator(_with_size)]], Field(min_length=1)]
    robot_type: str | None = None
    data_path: str
    video_path: str | None = None

    @property
    def spec(self) -> TaskSpec:
        """First task of the robot that the dataset was recorded with; all tasks of a robot share its columns.

        Which of them an episode plays stands in its column `excav.task`.

        Raises:
            DatasetError: It was recorded with another robot.
        """
        return task_of_robot(self.robot_type)

    def keys_of(self, dtype: str) -> list[str]:
        """Return the keys of the features of a type, such as `video`."""
        return [key for key, feature in self.features.items() if feature["dtype"] == dtype]

    def size_of(self, key: str) -> tuple[int, int]:
        """Return height and width of a camera's pictures [px]."""
        height, width, channels = self.features[key]["shape"]
        return (height, width) if channels in (1, 3) else (width, channels)  # channels may stand first

    def data_file(self, root: Path, chunk: int, file: int) -> Path:
        """Return the path of a file of frames.

        Raises:
            DatasetError: The pattern cannot be filled in.
        """
        with reading(f"data_path={self.data_path!r} in {root / INFO_PATH}"):
            return root / self.data_path.format(chunk_index=chunk, file_index=file)

    def video_file(self, root: Path, key: str, chunk: int, file: int) -> Path:
        """Return the path of a video.

        Raises:
            DatasetError: There is no pattern, or it cannot be filled in.
        """
        with reading(f"video_path={self.video_path!r} in {root / INFO_PATH}"):
            return root / str(self.video_path).format(video_key=key, chunk_index=chunk, file_index=file)


def read_info(root: Path) -> DatasetInfo:
    """Read what a dataset on disk says about itself.

    Raises:
        DatasetError: There is no dataset, the file is damaged, or it has another format.
    """
    path = root / INFO_PATH
    if not path.exists():
        raise DatasetError(f"{root} is not a LeRobot dataset: it has no {INFO_PATH}")
    return validated_file(DatasetInfo, path)
