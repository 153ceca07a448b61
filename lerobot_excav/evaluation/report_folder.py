"""The folder of a report, in which it replaces and removes its own files only.

`report_files.json` in the folder lists what reports have written there, with digests. A file that is not listed, or has
another content by now, belongs to somebody: it is never touched.
"""

import hashlib
import json
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Literal

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import write_whole

LIST = "report_files.json"


class _Listed(BaseModel):
    """What reports have written: by name, digests (SHA-256), several while a file is being replaced."""

    model_config = ConfigDict(strict=True, extra="forbid")

    written_by: Literal["lerobot-excav report"]
    files: dict[str, list[str]] = {}


class ReportFolder:
    """A folder to which reports write; it is made.

    Raises:
        DatasetError: Its list of files is damaged.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / LIST
        self._files = validated_file(_Listed, path).files if path.exists() else {}
        for name in self._files:
            if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
                raise DatasetError(f"{path}: {name!r} lies outside of the folder; remove {path}")

    @property
    def own(self) -> list[str]:
        """Names of the files that reports have written, and that are still as they were written."""
        return [name for name in self._files if (self.folder / name).is_file() and self._is_own(name)]

    def require_free(self, names: Iterable[str]) -> None:
        """Check that files may be written.

        Raises:
            DatasetError: A name is taken by something that no report has written, or that was changed since.
        """
        for name in names:
            path = self.folder / name
            if (path.exists() or path.is_symlink()) and not self._is_own(name):
                what = "was changed since a report wrote it" if name in self._files else "was not written by a report"
                raise DatasetError(f"{path} {what}; move it elsewhere, or choose another --out")

    @contextmanager
    def staged(self) -> Iterator[Path]:
        """Provide an empty folder beside the report's; when the block ends, its files take their places.

        Raises:
            DatasetError: A name is taken by what is not the report's; nothing was replaced.
        """
        with tempfile.TemporaryDirectory(prefix=".report.", dir=self.folder) as temporary:
            stage = Path(temporary)
            yield stage
            fresh = {p.relative_to(stage).as_posix(): file_digest(p) for p in sorted(stage.rglob("*")) if p.is_file()}
            self.require_free(fresh)
            # Both are listed while they change places, so that a kill leaves no file that is nobody's.
            self._list({**self._files, **{n: [*self._files.get(n, []), digest] for n, digest in fresh.items()}})
            for name in fresh:
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                (stage / name).replace(self.folder / name)
            self._list({**self._files, **{name: [digest] for name, digest in fresh.items()}})

    def remove(self, is_stale: Callable[[str], bool]) -> None:
        """Remove own files by name."""
        for name in filter(is_stale, self.own):
            (self.folder / name).unlink()
        self._list({name: known for name, known in self._files.items() if (self.folder / name).exists()})

    def _is_own(self, name: str) -> bool:
        path = self.folder / name
        return path.is_file() and file_digest(path) in self._files.get(name, [])

    def _list(self, files: dict[str, list[str]]) -> None:
        self._files = files
        listed = _Listed(written_by="lerobot-excav report", files=files)
        write_whole(self.folder / LIST, json.dumps(listed.model_dump(), indent=1) + "\n")


def file_digest(path: Path) -> str:
    """Return the digest (SHA-256) of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
