"""The masks that were found for an episode, and a file that keeps them while others are still looked for."""

import base64
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.errors import DatasetError
from lerobot_excav.run_lock import RunLock
from lerobot_excav.whole_file import write_whole


@dataclass(frozen=True, kw_only=True)
class FoundMask:
    """A mask, from some frame of an episode on.

    Attributes:
        frame: First frame that shows it.
        pixels: (H, W) bool.
        parameters: What the source says of it.
    """

    frame: int
    pixels: NDArray[np.bool_]
    parameters: Mapping[str, Any]

    @property
    def png(self) -> bytes:
        """The mask as datasets keep it: black and white in three channels."""
        buffer = io.BytesIO()
        grey = np.where(self.pixels, 255, 0).astype(np.uint8)
        Image.fromarray(np.repeat(grey[..., None], 3, axis=-1)).save(buffer, format="png")
        return buffer.getvalue()

    def as_record(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {"frame": self.frame, "png": base64.b64encode(self.png).decode(), "parameters": dict(self.parameters)}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Self:
        """Rebuild it from `as_record`."""
        picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(record["png"]))))
        return cls(frame=record["frame"], pixels=picture[..., 0] > 127, parameters=record["parameters"])


class FoundMasks:
    """What was found so far, in a file beside the dataset to be: `OUT.masks.jsonl`.

    Args:
        out: The dataset to be.
        settings: What decides about the masks; a file of other settings is refused.

    Attributes:
        episodes: The masks by episode.

    Raises:
        DatasetError: The file is of other settings, is none of these, or another process is at it.
    """

    def __init__(self, out: Path, settings: Mapping[str, Any]) -> None:
        self._path = out.with_name(f"{out.name}.masks.jsonl")
        out.parent.mkdir(parents=True, exist_ok=True)
        self._lock = RunLock(self._path.with_suffix(".lock"), self._path)
        try:
            self.episodes = self._read(dict(settings))
        except BaseException:
            self._lock.release()
            raise

    def add(self, episode: int, masks: list[FoundMask]) -> None:
        """Keep the masks of an episode."""
        self.episodes[episode] = masks
        line = json.dumps({"episode_index": episode, "masks": [mask.as_record() for mask in masks]})
        with self._path.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")

    def clear(self) -> None:
        """Remove the file: the dataset is written."""
        self._path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._lock.release()

    def _read(self, settings: dict[str, Any]) -> dict[int, list[FoundMask]]:
        if not self._path.exists():
            write_whole(self._path, json.dumps(settings) + "\n")
            return {}
        try:
            first, *lines = self._path.read_text(encoding="utf-8").splitlines(keepends=True)
            begun = json.loads(first)
        except ValueError:  # empty, no text, or no JSON
            begun, lines = None, []
        whole = [line for line in lines if line.endswith("\n")]  # an interruption may have cut the last one short
        is_empty = isinstance(begun, dict) and set(begun) == set(settings) and not whole
        if begun != settings and not is_empty:
            raise DatasetError(
                f"{self._path} was not begun by this command with these options; remove it, or choose another --out"
            )
        write_whole(self._path, "".join([json.dumps(settings) + "\n", *whole]))
        with reading(self._path):
            found = map(json.loads, whole)
            return {each["episode_index"]: [FoundMask.from_record(mask) for mask in each["masks"]] for each in found}
