"""Finished episodes on disk, one by one, until a dataset is assembled from them.

An episode is two files: `NAME.npz` with the frames (only if it is kept) and `NAME.json` with its outcome. Both appear
whole, the outcome last, so an outcome on disk means that the episode is complete.
"""

import io
import json
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydantic import ConfigDict, TypeAdapter, with_config

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.record.episode import TRACES, Episode
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import unfinished, write_whole

# Only a stopover: LeRobot compresses again, so speed counts here (level 1 takes a third of level 6's time).
PNG_LEVEL = 1


@with_config(ConfigDict(extra="allow"))
class Outcome(TypedDict):
    """What came of an episode; there may be more in it, which stays."""

    pair_uid: str
    success: bool
    frames: int
    kept: bool
    mask_missing_frames: int
    metrics: dict[str, Any]
    absent: NotRequired[bool]  # whether the start offers no such target, so that nothing was played


_STORED = (*TRACES, "outcome", "rest_frames")
_WORDS = ("task", "operator")

_OUTCOME = TypeAdapter(Outcome)


class EpisodeStore:
    """A folder of finished episodes; it is made if it is missing."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def write(self, episode: Episode, *, keep_frames: bool) -> Outcome:
        """Write a finished episode, with its frames or without; return the outcome that was written."""
        outcome: Outcome = {
            "pair_uid": episode.pair.uid,
            "success": episode.success,
            "frames": episode.length,
            "kept": keep_frames,
            "mask_missing_frames": episode.mask_missing_frames,
            "metrics": episode.metrics,
        }
        if keep_frames:
            buffer = io.BytesIO()
            np.savez(buffer, allow_pickle=False, **_arrays(episode))
            write_whole(self._path(episode.pair, "npz"), buffer.getbuffer())
        write_whole(self._path(episode.pair, "json"), json.dumps(outcome))
        return outcome

    def write_absent(self, pair: Pair) -> Outcome:
        """Note that a start offers no such target; return the outcome that was written."""
        nothing: Outcome = {
            "pair_uid": pair.uid,
            "success": False,
            "frames": 0,
            "kept": False,
            "mask_missing_frames": 0,
            "metrics": {},
            "absent": True,
        }
        write_whole(self._path(pair, "json"), json.dumps(nothing))
        return nothing

    def outcome(self, pair: Pair) -> Outcome | None:
        """Return the outcome of an episode, or None if it is not finished.

        Raises:
            DatasetError: The file is damaged.
        """
        path = self._path(pair, "json")
        try:
            outcome = _OUTCOME.validate_json(path.read_bytes())
        except FileNotFoundError:
            return None
        except ValueError as error:
            raise _damaged(path) from error
        if outcome["pair_uid"] != pair.uid:
            raise _damaged(path)
        return outcome

    def pairs_of_start(self, start: Pair) -> list[Pair]:
        """Return the finished episodes from the start of a pair, in the order of their targets."""
        stem = self._path(start, "json").stem.rpartition("-")[0]
        targets = (path.stem.rpartition("-")[2] for path in self._folder.glob(f"{stem}-*.json"))
        return [
            start._replace(target_id=target) for target in sorted(int(word) for word in targets if word.isdecimal())
        ]

    def read(self, pair: Pair) -> Episode:
        """Read a finished episode whose frames were kept.

        Raises:
            DatasetError: The file of the frames is damaged or missing.
        """
        outcome = self.outcome(pair)
        assert outcome is not None
        path = self._path(pair, "npz")
        try:
            with reading(path):
                arrays = _frames(path)
        except DatasetError as error:
            raise _damaged(path) from error
        return Episode(
            pair=pair,
            **arrays,
            success=outcome["success"],
            mask_missing_frames=outcome["mask_missing_frames"],
            metrics=outcome["metrics"],
        )

    def remove(self, pairs: Iterable[Pair]) -> None:
        """Remove the files of episodes, and the folder unless it holds something else."""
        names = {self._path(pair, suffix).name for pair in pairs for suffix in ("npz", "json")}
        for path in self._folder.iterdir():
            if path.name in names or unfinished(path) in names:
                path.unlink()
        with suppress(OSError):
            self._folder.rmdir()

    def _path(self, pair: Pair, suffix: str) -> Path:
        return self._folder / f"{pair.uid.replace('/', '-')}.{suffix}"


def _damaged(path: Path) -> DatasetError:
    return DatasetError(
        f"{path} is missing or damaged; remove {path.with_suffix('.json')}, and go on with --resume=true: "
        "the episode is played again"
    )


def _arrays(episode: Episode) -> dict[str, NDArray[Any]]:
    words = {name: np.array(getattr(episode, name)) for name in _WORDS}
    arrays = {**words, **{name: np.asarray(getattr(episode, name)) for name in _STORED}}
    for camera, frames in episode.images.items():
        arrays[f"png:{camera}"], arrays[f"end:{camera}"] = _encode(frames)
    return arrays


def _frames(path: Path) -> dict[str, Any]:
    """Return task, images and traces from a file of `_arrays`."""
    with np.load(path) as stored:
        arrays = {key: stored[key] for key in stored.files}
    cameras = sorted({key.split(":")[1] for key in arrays if key.startswith("png:")})
    images = {camera: _decode(arrays[f"png:{camera}"], arrays[f"end:{camera}"]) for camera in cameras}
    stored = {name: arrays[name] for name in _STORED}
    words = {name: str(arrays[name]) for name in _WORDS}
    return {**words, "images": images, **stored, "rest_frames": int(stored["rest_frames"])}


def _encode(frames: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compress images (n, H, W, 3) into one run of bytes and the end of each within it."""
    buffer = io.BytesIO()
    ends = []
    for frame in frames:
        Image.fromarray(frame).save(buffer, format="png", compress_level=PNG_LEVEL)
        ends.append(buffer.tell())
    return np.frombuffer(buffer.getvalue(), dtype=np.uint8), np.array(ends, dtype=np.int64)


def _decode(data: NDArray[Any], ends: NDArray[Any]) -> NDArray[Any]:
    pictures = np.split(data, ends[:-1])
    return np.stack([np.asarray(Image.open(io.BytesIO(picture.tobytes()))) for picture in pictures])
