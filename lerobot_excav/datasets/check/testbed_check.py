"""Check of a recording of a real machine: it has no scene that could be shown again, but it says when it was late."""

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from numpy.typing import NDArray

from lerobot_excav.datasets.check.episode_check import ACTION_MARGIN
from lerobot_excav.datasets.check.quality_report import Findings
from lerobot_excav.datasets.check.readability import check_opening
from lerobot_excav.datasets.format.alignment_columns import (
    ALIGNMENT_COLUMNS,
    IMAGE_AGE_KEY,
    IS_AS_TOLD_KEY,
    IS_CAUSAL_KEY,
    STATE_AGE_KEY,
)
from lerobot_excav.datasets.format.dataset_info import DatasetInfo
from lerobot_excav.datasets.format.frame_files import EpisodeRows, iterate_rows
from lerobot_excav.datasets.format.metadata import EpisodeMetadata, missing_files
from lerobot_excav.datasets.format.schema import ACTION_KEY, MASK_KEY, PAIR_KEY, STATE_KEY

_READ = (ACTION_KEY, STATE_KEY, *ALIGNMENT_COLUMNS)


def is_testbed_recording(info: DatasetInfo) -> bool:
    """Tell whether frames say how old they are, and name no scene of a simulator."""
    return set(ALIGNMENT_COLUMNS) <= set(info.features) and PAIR_KEY not in info.features


def check_testbed_recording(
    root: Path,
    info: DatasetInfo,
    metadata: Sequence[EpisodeMetadata],
    findings: Findings,
    episodes: Collection[int] | None = None,
) -> None:
    """Check numbers, ages and masks of a recording that `lerobot-excav alignment` has completed.

    Frames whose pictures or state were too old, and those in which the machine did something else than the action says,
    fail their episode: a policy must not learn from them.

    Args:
        root: The recording.
        info: What it says about itself.
        metadata: What it says of its episodes, as far as that can be read.
        findings: What was found before; what is found is added.
        episodes: Episodes to check; all by default.
    """
    missing = [key for key in _READ if key not in info.features]
    if missing:
        findings.dataset.append(f"the column {missing[0]} is missing")
        return
    findings.dataset += findings.attempt(lambda: list(missing_files(root, info, metadata))) or []
    for rows in iterate_rows(root, info, _READ, episodes=episodes, report=findings.note):
        findings.episodes[rows.index] = list(rows.problems) or list(_problems(rows))
        findings.lengths[rows.index] = rows.table.num_rows
    check_opening(root, info, findings)
    if MASK_KEY in info.features and not findings.dataset:
        _check_masks(root, findings)


def _problems(rows: EpisodeRows) -> Iterator[str]:
    columns = {key: np.array(rows.table[key].to_pylist()) for key in _READ}
    most = 1.0 + 2.0 * ACTION_MARGIN
    if (greatest := float(np.nanmax(np.abs(columns[ACTION_KEY])))) > most:
        yield f"an action reaches {greatest:.3g}; allowed are -1 to 1"
    yield from _marked(
        columns[IS_CAUSAL_KEY],
        f"saw pictures or a state that were too old, up to {columns[IMAGE_AGE_KEY].max():.0f} and "
        f"{columns[STATE_AGE_KEY].max():.0f} ms",
    )
    yield from _marked(columns[IS_AS_TOLD_KEY], "did something else than their action says")


def _marked(is_right: NDArray[np.bool_], words: str) -> Iterator[str]:
    if count := int((~is_right).sum()):
        yield f"{count} of {len(is_right)} frames {words}, the first one frame {int(np.argmin(is_right))}"


def _check_masks(root: Path, findings: Findings) -> None:
    """Look at the first mask of every sound episode: without a target nobody knows what was shown."""
    dataset = LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")
    for index in findings.sound():
        first = int(dataset.meta.episodes[index]["dataset_from_index"])
        try:
            mask = dataset[first][MASK_KEY].numpy()
        except Exception as error:  # of whatever library reads pictures
            findings.episodes[index].append(f"the target mask of frame 0 cannot be read: {error}")
            continue
        if not mask.any():
            findings.episodes[index].append("the target mask is empty at frame 0")
        elif not np.isin(mask, (0.0, 1.0)).all():
            findings.episodes[index].append("the target mask is not binary at frame 0; allowed are 0 and 255")
