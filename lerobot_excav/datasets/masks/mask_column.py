"""A copy of a dataset whose mask column holds other masks; all other values and videos stay as they are."""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from lerobot.datasets.compute_stats import aggregate_stats, get_feature_stats
from lerobot.datasets.io_utils import load_stats, write_stats
from numpy.typing import NDArray

from lerobot_excav.datasets.card.dataset_card import CARD_PATH, PICTURE_PATH, is_own_card
from lerobot_excav.datasets.format.dataset_info import INFO_PATH
from lerobot_excav.datasets.format.schema import MASK_KEY, MASK_SOURCE_KEY
from lerobot_excav.datasets.masks.found_masks import FoundMask
from lerobot_excav.datasets.pairs.paired_index import INDEX_PATH
from lerobot_excav.whole_file import write_whole

PROVENANCE_PATH = Path("meta/excav_masks.json")
"""Who has made the masks, and what was found, episode by episode."""

_PICTURE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])

Masks = Mapping[int, Sequence[FoundMask]]


def write_with_masks(root: Path, out: Path, masks: Masks, provenance: Mapping[str, Any]) -> None:
    """Write a copy of a dataset with the masks of every episode, as pictures in the table of frames.

    Args:
        root: The dataset.
        out: The copy; must not exist.
        masks: The masks of all episodes, by their index.
        provenance: What is noted beside them; its `source` becomes `excav.mask_source`.
    """
    shutil.copytree(root, out, ignore=_left_out(root))
    for path in sorted(out.glob("data/*/*.parquet")):
        pq.write_table(_with_masks(pq.read_table(path), masks, str(provenance["source"])), path)
    _declare(out / INFO_PATH, next(iter(masks.values()))[0].pixels.shape)
    _write_statistics(out, masks)
    found = [
        {"episode_index": index, "masks": [{"frame": each.frame, **each.parameters} for each in masks[index]]}
        for index in sorted(masks)
    ]
    write_whole(out / PROVENANCE_PATH, json.dumps({**provenance, "episodes": found}, indent=1) + "\n")


def _left_out(root: Path) -> Any:
    """Leave out the old masks, and what is about them: the index, and a card of ours with its picture."""
    old = {root / "videos" / MASK_KEY, root / "images" / MASK_KEY, root / INDEX_PATH}
    if is_own_card(root):
        old |= {root / CARD_PATH, root / PICTURE_PATH}
    return lambda folder, names: [name for name in names if Path(folder, name) in old]


def _with_masks(table: pa.Table, masks: Masks, source: str) -> pa.Table:
    episodes, frames = table["episode_index"].to_pylist(), table["frame_index"].to_pylist()
    files = {index: [(mask.frame, mask.png) for mask in found] for index, found in masks.items()}
    values = []
    for episode, frame in zip(episodes, frames, strict=True):
        shown = [png for since, png in files[episode] if since <= frame][-1]
        values.append({"bytes": shown, "path": f"frame-{frame:06d}.png"})
    table = _replaced(table, MASK_KEY, pa.array(values, _PICTURE))
    if MASK_SOURCE_KEY in table.column_names:
        table = _replaced(table, MASK_SOURCE_KEY, pa.array([source] * len(table), pa.string()))
    return table.replace_schema_metadata(None)  # it describes the old columns; LeRobot reads meta/info.json


def _replaced(table: pa.Table, name: str, values: pa.Array) -> pa.Table:
    if name in table.column_names:
        return table.set_column(table.column_names.index(name), name, values)
    return table.append_column(name, values)


def _declare(path: Path, size: Sequence[int]) -> None:
    info = json.loads(path.read_text(encoding="utf-8"))
    height, width = size
    info["features"][MASK_KEY] = {
        "dtype": "image",
        "shape": [height, width, 3],
        "names": ["height", "width", "channels"],
        "info": {"is_depth_map": False},
    }
    if not any(feature["dtype"] == "video" for feature in info["features"].values()):
        info["video_path"] = None
    write_whole(path, json.dumps(info, indent=4) + "\n")


def _write_statistics(root: Path, masks: Masks) -> None:
    """Write the statistics of the masks, as LeRobot has them for pictures; old ones of videos go."""
    episodes = {index: _statistics(found) for index, found in masks.items()}
    stale = (f"stats/{MASK_KEY}/", f"videos/{MASK_KEY}/")
    for path in sorted(root.glob("meta/episodes/*/*.parquet")):
        table = pq.read_table(path)
        indices = table["episode_index"].to_pylist()
        table = table.drop_columns([name for name in table.column_names if name.startswith(stale)])
        for name in episodes[indices[0]]:
            values = pa.array([episodes[index][name].tolist() for index in indices])
            table = table.append_column(f"stats/{MASK_KEY}/{name}", values)
        pq.write_table(table, path)
    written = aggregate_stats([{MASK_KEY: each} for each in episodes.values()])
    write_stats((load_stats(root) or {}) | written, root)


def _statistics(found: Sequence[FoundMask]) -> dict[str, NDArray[Any]]:
    pictures = np.stack([np.repeat(255 * mask.pixels[None].astype(np.uint8), 3, axis=0) for mask in found])
    seen = get_feature_stats(pictures, axis=(0, 2, 3), keepdims=True)
    return {name: value if name == "count" else np.squeeze(value / 255.0, axis=0) for name, value in seen.items()}
