"""What can still be read of a recording whose files were not closed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
from pydantic import BaseModel, NonNegativeInt, ValidationError

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.format.schema import Feature
from lerobot_excav.datasets.format.storage import Storage
from lerobot_excav.errors import DatasetError


class RecordedInfo(BaseModel):
    """What `meta/info.json` says: frames per second, columns by key, robot, and how many episodes were saved."""

    fps: int
    features: dict[str, Feature]
    robot_type: str | None
    total_episodes: NonNegativeInt


@dataclass(frozen=True, kw_only=True)
class Remains:
    """What a damaged recording tells of itself.

    Attributes:
        root: Its folder.
        info: Its description; None if that cannot be read.
        texts: Task texts that it holds.
        episode_texts: Task texts by episode index, of the episodes whose own can be read.
    """

    root: Path
    info: RecordedInfo | None
    texts: list[str]
    episode_texts: dict[int, str]

    @property
    def storage(self) -> Storage:
        """How pictures are stored."""
        if self.info is None:
            return "video" if (self.root / "videos").exists() else "image"
        return "video" if self._videos else "image"

    @property
    def video_info(self) -> dict[str, Any]:
        """How its videos were encoded; empty where no episode was saved."""
        infos = [feature.get("info") or {} for feature in self._videos]
        return next((info for info in infos if "video.codec" in info), {})

    @property
    def _videos(self) -> list[Feature]:
        features = self.info.features.values() if self.info else ()
        return [feature for feature in features if feature["dtype"] == "video"]

    def text_of(self, episode_index: int, given: str | None, default: str) -> str:
        """Return the task text of an episode: its own, else the one given, else the only one there is.

        Raises:
            DatasetError: There are several, and none was given.
        """
        if episode_index in self.episode_texts:
            return self.episode_texts[episode_index]
        if given is None and len(self.texts) > 1:
            raise DatasetError(
                f"{self.root} has {len(self.texts)} task texts, and which of them episode {episode_index} had cannot "
                f"be read; give it with --task: {', '.join(map(repr, self.texts))}"
            )
        return given or next(iter(self.texts), default)


def read_remains(root: Path) -> Remains:
    """Read what can be read.

    Raises:
        DatasetError: There was never a dataset.
    """
    meta = root / "meta"
    if not meta.is_dir():
        raise DatasetError(f"{root} is not a recording of lerobot-record: it has no folder meta")
    return Remains(
        root=root,
        info=_read_info(meta / "info.json"),
        texts=_read_texts(meta / "tasks.parquet"),
        episode_texts=dict(pair for path in sorted(meta.glob("episodes/*/*.parquet")) for pair in _read_episodes(path)),
    )


def _read_info(path: Path) -> RecordedInfo | None:
    try:
        return RecordedInfo.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def _read_texts(path: Path) -> list[str]:
    try:
        with reading(path):
            return [text for text in pd.read_parquet(path).index if isinstance(text, str)]
    except DatasetError:
        return []


def _read_episodes(path: Path) -> list[tuple[int, str]]:
    try:
        with reading(path):
            rows = pq.read_table(path, columns=["episode_index", "tasks"]).to_pylist()
            texts = [(row["episode_index"], next(iter(row["tasks"] or ()), None)) for row in rows]
    except DatasetError:
        return []
    return [(index, text) for index, text in texts if isinstance(text, str)]
