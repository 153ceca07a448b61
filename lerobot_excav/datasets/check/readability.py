"""Whether LeRobot can read a dataset: first what it needs is looked for, then it is opened as `lerobot-train` does.

LeRobot itself asks the Hugging Face Hub for files that are missing, fills missing columns with nulls, and ends with the
whole process over some damaged videos. So it is let at a dataset, or at an episode, in which nothing else was found.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq

from lerobot_excav.datasets.check.quality_report import Findings
from lerobot_excav.datasets.format.dataset_info import INFO_PATH, PICTURE_DTYPES, DatasetInfo
from lerobot_excav.datasets.format.frame_files import frame_files
from lerobot_excav.datasets.format.metadata import EpisodeMetadata, missing_files
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.schema import ACTION_KEY
from lerobot_excav.errors import ConfigurationError, DatasetError


def layout_problems(root: Path, info: DatasetInfo, episodes: Sequence[EpisodeMetadata]) -> Iterator[str]:
    """Describe in plain words what does not fit together: columns, paths, sizes and frame rate of a dataset."""
    for path in frame_files(root):
        try:
            with reading(path):
                extra = [name for name in pq.read_schema(path).names if name not in info.features]
        except DatasetError:
            continue  # reading its frames tells
        if extra:
            yield f"{path} has the columns {', '.join(extra)}, which {INFO_PATH} does not declare: LeRobot refuses them"
    yield from missing_files(root, info, episodes)
    yield from _setting_problems(info)
    total = sum(episode.length for episode in episodes)
    if episodes and total != info.total_frames:
        yield f"{root / INFO_PATH} counts {info.total_frames} frames, but meta/episodes has {total}"


def _setting_problems(info: DatasetInfo) -> Iterator[str]:
    """Compare frame rate and size of pictures with what the task can be set to."""
    sizes = {key: info.size_of(key) for dtype in PICTURE_DTYPES for key in info.keys_of(dtype)}
    if len(set(sizes.values())) > 1:
        yield f"{INFO_PATH}: pictures have different sizes: {sizes}"
    for height, width in sorted(set(sizes.values())):
        try:
            info.spec.make_settings(fps=info.fps, observation_height=height, observation_width=width)
        except ConfigurationError as error:
            yield f"{INFO_PATH}: {error}"


def check_opening(root: Path, info: DatasetInfo, findings: Findings) -> None:
    """Let LeRobot open what is sound, unless something is wrong with the whole dataset."""
    lengths = {index: findings.lengths[index] for index in findings.sound()}
    if lengths and not findings.dataset:
        is_whole = len(lengths) == info.total_episodes
        if problem := opening_problem(root, info, lengths, is_whole=is_whole):
            findings.dataset.append(problem)


def opening_problem(root: Path, info: DatasetInfo, lengths: Mapping[int, int], *, is_whole: bool) -> str:
    """Open a dataset as `lerobot-train` does, and read the first and the last frame of episodes in which all is well.

    Args:
        root: The dataset.
        info: What it says about itself.
        lengths: Lengths of these episodes.
        is_whole: Whether they are all.

    Returns:
        What LeRobot says against it, or an empty text.
    """
    from lerobot.datasets import LeRobotDataset

    chosen = sorted(lengths)
    try:
        with _quiet(), reading(f"{root}, opened by LeRobot as for training,"):
            dataset = LeRobotDataset(
                f"local/{root.name}",
                root=root,
                episodes=None if is_whole else chosen,
                delta_timestamps={ACTION_KEY: [0.0, 1.0 / info.fps]},
                video_backend="pyav",
            )
            end = 0
            for episode in chosen:
                end += lengths[episode]
                for row in (end - lengths[episode], end - 1):
                    _ = dataset[row]
    except DatasetError as problem:
        return str(problem)
    return ""


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the log of a failure to oneself, as what is raised says it all."""
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)
