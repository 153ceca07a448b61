"""The folder of a run that is not finished."""

import json
import logging
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode_store import EpisodeStore
from lerobot_excav.errors import DatasetError, ExcavError
from lerobot_excav.run_lock import RunLock
from lerobot_excav.whole_file import unfinished, write_whole

logger = logging.getLogger(__name__)

LOCK, SETTINGS = ".excav_demos.lock", "settings.json"
_MARK = {"simulation_version", "env.type"}  # entries of the settings that no other program writes
_DATASET_FILES = {".parquet", ".json", ".png", ".mp4", ".lock"}  # what LeRobot writes


class PartialRun:
    """Opens, or starts, the partial folder of a dataset and holds it alone.

    The folder is known by its settings, which are written first and removed last. Nothing is removed but what a run
    writes.

    Args:
        out: The dataset that is to become of it.
        settings: Settings of the run.
        resume: Whether a started run may be continued.

    Attributes:
        folder: The partial folder.

    Raises:
        DatasetError: The folder was not made by a run, another process is at it, a started run lies there and `resume`
            is false, or files of someone else lie in the unfinished dataset.
        ConfigurationError: The started run has other settings.
    """

    def __init__(self, out: Path, settings: DemonstrationSettings, *, resume: bool) -> None:
        self.folder = _folder(out)
        self._settings = settings
        is_started = self._require_ours()
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock = RunLock(self.folder / LOCK, self.folder)
        try:
            if is_started and not resume:
                raise DatasetError(
                    f"{self.folder} holds an interrupted run; continue it with --resume, or remove the folder"
                )
            self._match_settings()
            self.episodes.mkdir(exist_ok=True)
            self.remove_unfinished_dataset()
        except BaseException:
            self._lock.release()
            raise

    @property
    def episodes(self) -> Path:
        """Folder of the finished episodes."""
        return self.folder / "episodes"

    @property
    def dataset(self) -> Path:
        """Folder of the growing dataset."""
        return self.folder / "dataset"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._lock.release()
        with suppress(OSError):  # kept unless it is empty
            self.folder.rmdir()

    def clear(self) -> None:
        """Remove what the run has written, after its dataset was moved away; what others put there is kept."""
        EpisodeStore(self.episodes).remove(self._settings.possible_pairs())
        for leftover in self.folder.iterdir():
            if unfinished(leftover) == SETTINGS:
                leftover.unlink()
        if others := sorted(path.name for path in self.folder.iterdir() if path.name not in (LOCK, SETTINGS)):
            logger.warning(f"{self.folder} is kept: {', '.join(others)} in it is not of the run")
        (self.folder / SETTINGS).unlink()

    @staticmethod
    def clear_finished(out: Path, settings: DemonstrationSettings) -> None:
        """Remove what a run that was killed at its very end has left beside its dataset, if anything."""
        if _folder(out).is_dir():
            with suppress(ExcavError), PartialRun(out, settings, resume=True) as left:
                left.clear()

    def _require_ours(self) -> bool:
        """Return whether a run was started here.

        Raises:
            DatasetError: Something else lies in its place.
        """
        if not (self.folder.exists() or self.folder.is_symlink()):
            return False
        if self.folder.is_dir() and _read_mark(self.folder / SETTINGS) is not None:
            return True
        # A run that was killed at once has left nothing but these.
        if self.folder.is_dir() and all(p.name == LOCK or unfinished(p) == SETTINGS for p in self.folder.iterdir()):
            return False
        raise DatasetError(
            f"{self.folder} is in the way, and was not made by `lerobot-excav demos`, which leaves its {SETTINGS} "
            "there; move it elsewhere, or choose another --out"
        )

    def _match_settings(self) -> None:
        path = self.folder / SETTINGS
        record = _read_mark(path)
        if record is None:
            write_whole(path, json.dumps(self._settings.as_record(), indent=2))
        else:
            self._settings.require_same(DemonstrationSettings.from_record(record, source=path))

    def remove_unfinished_dataset(self) -> None:
        """Remove what was assembled of the dataset so far, so that it can be assembled from the beginning.

        Raises:
            DatasetError: Files of someone else lie in it.
        """
        # The library's files are complete only once it has closed them, so assembly starts again; it is the quick part.
        if not self.dataset.exists():
            return
        for path in self.dataset.rglob("*"):
            # LeRobot keeps its files in folders.
            is_of_run = path.suffix in _DATASET_FILES and (path.parent != self.dataset or path.suffix == ".lock")
            if not path.is_dir() and not is_of_run:
                raise DatasetError(f"{path} is not of the run, whose dataset is made again; move it elsewhere")
        shutil.rmtree(self.dataset)


def _read_mark(path: Path) -> dict[str, Any] | None:
    """Return the settings of a run, or None if the file does not hold any."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, IsADirectoryError, ValueError):
        return None
    return record if isinstance(record, dict) and record.keys() >= _MARK else None


def _folder(out: Path) -> Path:
    return out.with_name(f"{out.name}.partial")
