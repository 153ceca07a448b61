"""The folder of a run that is not finished."""

import fcntl
import json
import shutil
from pathlib import Path
from typing import IO, Any

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.errors import DatasetError


class PartialRun:
    """Opens, or starts, the partial folder of a dataset and holds it alone.

    Args:
        out: The dataset that is to become of it.
        settings: Settings of the run.
        resume: Whether a started run may be continued.

    Attributes:
        folder: The partial folder.

    Raises:
        DatasetError: A started run lies there and `resume` is false, or another process is at it.
        ConfigurationError: The started run has other settings.
    """

    def __init__(self, out: Path, settings: DemonstrationSettings, *, resume: bool) -> None:
        self.folder = _folder(out)
        if self.folder.exists() and not resume:
            raise DatasetError(
                f"{self.folder} holds an interrupted run; continue it with --resume, or remove the folder"
            )
        self.episodes.mkdir(parents=True, exist_ok=True)
        self._lock = self._take_lock()
        self._match_settings(settings)
        # The library's files are complete only once it has closed them, so assembly starts again; it is the quick part.
        shutil.rmtree(self.dataset, ignore_errors=True)

    @property
    def episodes(self) -> Path:
        """Folder of the finished episodes."""
        return self.folder / "episodes"

    @property
    def dataset(self) -> Path:
        """Folder of the growing dataset."""
        return self.folder / "dataset"

    def __enter__(self) -> "PartialRun":
        return self

    def __exit__(self, *exception: object) -> None:
        self._lock.close()

    @staticmethod
    def remove(out: Path) -> None:
        """Remove the partial folder of a finished dataset, if there is one."""
        shutil.rmtree(_folder(out), ignore_errors=True)

    def _take_lock(self) -> IO[Any]:
        # The system lets go of it when the process ends, however it ends.
        lock = (self.folder / "lock").open("w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            raise DatasetError(f"another process is writing {self.folder}; wait for it or stop it") from None
        return lock

    def _match_settings(self, settings: DemonstrationSettings) -> None:
        path = self.folder / "settings.json"
        try:
            started = DemonstrationSettings.from_record(json.loads(path.read_text()), source=path)
        except (FileNotFoundError, json.JSONDecodeError):
            # Nothing was simulated before the settings were whole.
            path.write_text(json.dumps(settings.as_record(), indent=2))
        else:
            settings.require_same(started)


def _folder(out: Path) -> Path:
    return out.with_name(f"{out.name}.partial")
