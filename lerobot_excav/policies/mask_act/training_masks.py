"""Masks of the dataset that a policy is trained on: can they be used, and do they arrive as they are stored?"""

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from datasets import Image
from lerobot.configs import NormalizationMode
from lerobot.datasets import LeRobotDatasetMetadata
from lerobot.datasets.video_utils import decode_video_frames
from torch import Tensor
from torchvision.transforms.functional import to_tensor

from lerobot_excav.errors import DatasetError, require
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.features import MISSING_MASK_HINT
from lerobot_excav.policies.mask_act.views import Batch

LOG = logging.getLogger(__name__)

# Of the first batch all masks are compared, then one of every tenth batch: reading one takes about 10 ms.
BATCHES_BETWEEN = 10
# Lossy videos and sharpness change single pixels at a border, which is a small part of any mask that can be acted on;
# moving the mask of a block (7 x 7 pixels) by one pixel changes a quarter of it.
TOLERATED_PART = 0.05

# White stays above one half and black below it, whatever these draw: 0.8 x 0.8 is the darkest white, and a sharpness
# of 1 or more only widens the gap. LeRobot's default set has `affine` and blurs (a sharpness below 1) besides.
SAFE_TRANSFORMS = (
    "--dataset.image_transforms.enable=true --dataset.image_transforms.tfs='{"
    "brightness: {type: ColorJitter, kwargs: {brightness: [0.8, 1.2]}}, "
    "contrast: {type: ColorJitter, kwargs: {contrast: [0.8, 1.2]}}, "
    "saturation: {type: ColorJitter, kwargs: {saturation: [0.5, 1.5]}}, "
    "hue: {type: ColorJitter, kwargs: {hue: [-0.05, 0.05]}}, "
    "sharpness: {type: SharpnessJitter, kwargs: {sharpness: [1.0, 1.5]}}}'"
)
STORE_255 = (
    "Store 0 outside the target and 255 on it (docs/how-to/your-own-dataset.md shows how to convert a dataset), or "
    "train the no-condition variant with --policy.withhold_mask=true."
)


class TrainingMasks:
    """Refuse masks that cannot be used, at the first moment at which it can be known.

    LeRobot's image transforms draw a motion for every camera by itself, the mask too, and neither batch nor statistics
    show it. So masks are compared with the stored frames that they come from.

    Args:
        config: Settings of the policy; with `withhold_mask` nothing is checked.
        meta: The dataset, as LeRobot's `make_policy` hands it over. None: only values can be checked.

    Raises:
        ConfigurationError: By the dataset's statistics its masks show no target, or the whole picture, in every frame.
    """

    def __init__(self, config: MaskACTConfig, meta: LeRobotDatasetMetadata | None) -> None:
        self._config, self._meta = config, None if config.withhold_mask else meta
        self._key = stored_key(config, self._meta) if self._meta is not None else None
        self._batch_count = 0
        stats = (self._meta.stats or {}).get(self._key, {}) if self._meta is not None else {}
        self._has_stats = "max" in stats and "min" in stats
        if self._has_stats:
            require_target(str(self._key), float(np.min(stats["min"])), float(np.max(stats["max"])))
        self._is_comparing = config.compare_masks
        if self._is_comparing and self._meta is not None and self._key is None:
            self._stop_comparing("--rename_map gives several pictures of the dataset new names")

    def check(self, batch: Batch, mask: Tensor) -> None:
        """Check the masks of a training batch, whenever it is their turn.

        Args:
            batch: The batch as the policy got it, with `index` and `episode_index` of its frames.
            mask: Its binary masks, shape (B, 1, H, W).

        Raises:
            ConfigurationError: A mask is not the stored one, or nothing is left of it when it is cut at one half.
        """
        if self._config.withhold_mask:
            return
        if not self._has_stats:
            require_upper_half(self._config.mask_key, batch[self._config.mask_key])
        number, self._batch_count = self._batch_count, self._batch_count + 1
        if not self._is_comparing or number % BATCHES_BETWEEN:
            return
        turn, size = number // BATCHES_BETWEEN, len(mask)
        for row in range(size) if turn == 0 else [turn % size]:
            if self._is_comparing:
                self._compare(batch, mask, row)

    def _compare(self, batch: Batch, mask: Tensor, row: int) -> None:
        if self._meta is None:
            self._stop_comparing("the policy was built without its dataset; give make_policy its ds_meta")
            return
        if not {"index", "episode_index"} <= batch.keys():
            self._stop_comparing("the batches have no index and episode_index")
            return
        index, episode = (int(batch[key].flatten()[row]) for key in ("index", "episode_index"))
        try:
            pixels = stored_mask(self._meta, str(self._key), index=index, episode=episode)
        except FileNotFoundError as error:
            self._stop_comparing(str(error))
            return
        if self._meta.features[self._key]["dtype"] == "image":  # a lossy video has other values where a mask is empty
            self._require_white(pixels, index, episode)
        stored = pixels > 0.5
        seen = mask[row].cpu() > 0.5
        if seen.shape != stored.shape:
            self._stop_comparing(f"a processor turns {tuple(stored.shape)} into {tuple(seen.shape)}")
            return
        require(
            bool((seen ^ stored).sum() <= TOLERATED_PART * (seen | stored).sum()),
            f"{self._config.mask_key}: the mask of frame {index} (episode {episode}) is not the one that the dataset "
            f"holds. Stored it covers {place(stored)}, in training {place(seen)}. LeRobot's image transforms move "
            "every camera by itself, and so part the mask from its picture. Use transforms that leave masks as they "
            f"are: {SAFE_TRANSFORMS}. To move picture and mask together, set --policy.augment_shift_px. If a processor "
            "of your own moves both, set --policy.compare_masks=false.",
        )

    def _require_white(self, pixels: Tensor, index: int, episode: int) -> None:
        """Refuse a mask of 0 and 1 among those of 0 and 255, as datasets that were merged may hold."""
        high = float(pixels.max())
        require(
            high == 0 or high > 0.5,
            f"{self._config.mask_key}: the mask of frame {index} (episode {episode}) has values up to "
            f"{255 * high:.3g} of 255; cut at one half, nothing would be left of it. {STORE_255}",
        )

    def _stop_comparing(self, reason: str) -> None:
        self._is_comparing = False
        LOG.warning(
            "Training cannot compare %s with the stored masks: %s. Image transforms that move or darken pictures would "
            "pass unseen; safe are: %s",
            *(self._config.mask_key, reason, SAFE_TRANSFORMS),
        )


def require_statistics(config: MaskACTConfig, meta: LeRobotDatasetMetadata) -> None:
    """Raise `ConfigurationError` if a dataset has no statistics for what is normalised: LeRobot leaves it as it is.

    `--rename_map` renames observations, not their statistics. A checkpoint without them could not be loaded.
    """
    features = {**config.input_features, **config.output_features}
    modes = config.normalization_mapping
    normalised = {
        key
        for key, feature in features.items()
        if modes.get(feature.type.value, NormalizationMode.IDENTITY) is not NormalizationMode.IDENTITY
    }
    missing = sorted(normalised - {config.mask_key} - (meta.stats or {}).keys())
    require(
        not missing or not meta.stats,
        f"the dataset has no statistics for {', '.join(missing)} (meta/stats.json), so LeRobot would not normalise it. "
        "--rename_map renames no statistics: name the features in the dataset as the policy does.",
    )


def stored_key(config: MaskACTConfig, meta: LeRobotDatasetMetadata) -> str | None:
    """Return the mask's name in the dataset; `--rename_map` may have changed it: None if several come into question."""
    if config.mask_key in meta.camera_keys:
        return config.mask_key
    pictures = [key for key in meta.camera_keys if key not in meta.depth_keys]
    renamed = [key for key in pictures if key not in config.image_features]
    return renamed[0] if len(renamed) == 1 else None


def stored_mask(meta: LeRobotDatasetMetadata, key: str, *, index: int, episode: int) -> Tensor:
    """Read the mask of one frame from a dataset's files, past every transform.

    Args:
        meta: The dataset.
        key: Name of the mask in it, stored as images or as a video.
        index: The frame's number in the whole dataset, column `index`.
        episode: The frame's episode.

    Returns:
        First channel, values in [0, 1], shape (1, H, W).

    Raises:
        DatasetError: The episode's file does not hold exactly one frame of this number.
        FileNotFoundError: The file is not there: the dataset is streamed.
    """
    is_image = meta.features[key]["dtype"] == "image"
    path = present(meta.root / meta.get_data_file_path(episode))
    columns = [key if is_image else "timestamp"]
    rows: list[dict[str, Any]] = pq.read_table(path, columns=columns, filters=[("index", "=", index)]).to_pylist()
    if len(rows) != 1:
        raise DatasetError(f"{path} holds {len(rows)} frames whose index is {index}; one is right. Check the dataset.")
    if is_image:
        pixels: Tensor = to_tensor(Image().decode_example(rows[0][key]))
    else:
        time = meta.episodes[episode][f"videos/{key}/from_timestamp"] + rows[0]["timestamp"]
        video = present(meta.root / meta.get_video_file_path(episode, key))
        # Not torchcodec, which keeps its decoders open: data loaders that fork after that hang.
        pixels = decode_video_frames(video, [time], 0.5 / meta.fps, backend="pyav")[0]
    return pixels[:1]


def present(path: Path) -> Path:
    """Return the path of a file that is there, or raise `FileNotFoundError`."""
    if not path.is_file():
        raise FileNotFoundError(f"{path} is not on this machine")
    return path


def require_target(mask_key: str, low: float, high: float) -> None:
    """Raise `ConfigurationError` if masks, by their lowest and highest value in a dataset, say nothing anywhere."""
    name = f"{mask_key}, the mask of the dataset,"
    require(
        high > 0,
        f"{name} is empty in every frame (meta/stats.json: no value above 0); nothing says where to act. "
        f"{MISSING_MASK_HINT}",
    )
    require(
        high > 0.5,
        f"{name} has values up to {255 * high:.3g} of 255 (meta/stats.json); cut at one half, nothing "
        f"would be left of it. {STORE_255}",
    )
    require(
        low <= 0.5,
        f"{name} covers the whole picture in every frame (meta/stats.json: no value below "
        f"{255 * low:.3g} of 255); nothing says where to act. {MISSING_MASK_HINT}",
    )


def require_upper_half(mask_key: str, mask: Tensor) -> None:
    """Raise `ConfigurationError` if a batch of masks has two values, neither above one half: {0, 1} of 255, say."""
    high = mask.max()
    require(
        bool((high == 0) | (high > 0.5) | ((mask != 0) & (mask != high)).any()),
        f"{mask_key} holds 0 and {high.item():.3g}; cut at one half, nothing would be left of it. {STORE_255}",
    )


def place(mask: Tensor) -> str:
    """Say how much a mask, bool (1, H, W), covers, and where."""
    rows, columns = mask[0].nonzero(as_tuple=True)
    if not len(rows):
        return "nothing"
    return f"{len(rows)} pixels around row {rows.float().mean():.1f}, column {columns.float().mean():.1f}"
