"""Changes of mind in the data: actions after a new command are no part of a plan made under the old one."""

import logging
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import torch
from lerobot.datasets import LeRobotDatasetMetadata
from numpy.typing import NDArray
from torch import Tensor

from lerobot_excav.errors import DatasetError, require
from lerobot_excav.policies.mask_act.views import Batch

LOG = logging.getLogger(__name__)

COMMAND_KEY = "excav.command_frame"
"""Column of a dataset: the frame of the episode from which on its command holds."""


class CommandChanges:
    """Knows how long the command of every frame of a dataset still holds.

    LeRobot's batches hold the actions that follow a frame, whatever was commanded meanwhile. To imitate those after a
    change of the mask would be to guess it.

    Args:
        meta: The dataset; None, or one without the column `COMMAND_KEY`, is taken to hold no changes.

    Raises:
        DatasetError: The files of the dataset hold other frames than its description says.
    """

    def __init__(self, meta: LeRobotDatasetMetadata | None) -> None:
        frames_left = frames_left_of(meta) if meta is not None and COMMAND_KEY in meta.features else np.zeros(1)
        self._frames_left = torch.from_numpy(frames_left) if frames_left.any() else None

    def is_pad(self, batch: Batch) -> Tensor:
        """Return which actions of a training batch are not to be learnt, bool (B, chunk_size): padding, later commands.

        Raises:
            ConfigurationError: The dataset holds changes, and the batch does not say which frames it is made of.
        """
        is_pad: Tensor = batch["action_is_pad"]
        if self._frames_left is None:
            return is_pad
        require(
            "index" in batch,
            f"the dataset holds changes of the command ({COMMAND_KEY}) and its batches have no column index, so "
            "nothing says which actions belong to which; keep index in the batches, or train on one command an episode",
        )
        left = self._frames_left[batch["index"].flatten().cpu()].to(is_pad.device)[:, None]
        later = torch.arange(is_pad.shape[1], device=is_pad.device)[None] >= left
        return is_pad | (later & (left > 0))


def frames_under_command(episode: NDArray[Any], command_frame: NDArray[Any]) -> NDArray[np.int32]:
    """Return how many frames, this one included, pass until the command changes, (n,); 0 where it never does.

    Args:
        episode: Episode of each frame of a dataset, in order, (n,).
        command_frame: Frame from which on its command holds, (n,).
    """
    count = len(episode)
    ends = np.flatnonzero((episode[1:] == episode[:-1]) & (command_frame[1:] != command_frame[:-1]))
    following = np.append(ends, count)[np.searchsorted(ends, np.arange(count))]
    belongs = (following < count) & (episode[np.minimum(following, count - 1)] == episode)
    return np.where(belongs, following - np.arange(count) + 1, 0).astype(np.int32)


def frames_left_of(meta: LeRobotDatasetMetadata) -> NDArray[np.int32]:
    """Return `frames_under_command` of every frame of a dataset, by its `index`; those of files elsewhere are 0."""
    columns = ["index", "episode_index", COMMAND_KEY]
    frames_left = np.zeros(meta.total_frames, np.int32)
    paths = sorted((meta.root / "data").rglob("*.parquet"))  # an episode lies in one file
    if not paths:
        LOG.warning(
            "%s is not on this machine, so nothing says where commands change; if they do within episodes, actions "
            "after a change are learnt under the mask before it. Train on a copy of the dataset that is here.",
            meta.root / "data",
        )
    for path in paths:
        index, episode, command_frame = (column.to_numpy().ravel() for column in pq.read_table(path, columns=columns))
        if index.size and not 0 <= index.min() <= index.max() < meta.total_frames:
            raise DatasetError(
                f"{path} holds the frames {index.min()} to {index.max()}, and meta/info.json says that there are "
                f"{meta.total_frames}; the dataset is damaged, take it from its source again"
            )
        frames_left[index] = frames_under_command(episode, command_frame)
    return frames_left
