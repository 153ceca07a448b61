"""A file of JSON Lines that grows while things happen, so that a crash loses at most the line being written."""

import errno
import json
import os
from io import FileIO
from pathlib import Path
from typing import Any


class ForeignFileError(OSError):
    """A file is there already, and is of another kind."""


class Journal:
    """Appends lines to a file; each is handed to the system at once, and nothing in the file is ever changed.

    Where a crash cut off the last line of an earlier process, the next line begins on a line of its own.

    Args:
        path: The file. It is made when the journal is opened, and its folder too.
        mark: What the first line of such a file holds; a file that begins otherwise is not written to.

    Raises:
        OSError: From every method: the file or its folder cannot be made or written.
    """

    def __init__(self, path: Path, *, mark: str) -> None:
        self.path = path
        self._mark = mark
        self._file: FileIO | None = None
        self._is_new = False
        self._is_cut_off = False

    def start(self) -> None:
        """Open the file to append to it, so that what is wrong with it is known before anything happens.

        Raises:
            ForeignFileError: The file holds something else.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._is_new = not self.path.exists()
        file = self.path.open("ab+", buffering=0)
        try:
            self._is_cut_off = self._check_contents(file)
        except OSError:
            file.close()
            raise
        self._file = file

    def write(self, *records: dict[str, Any]) -> None:
        """Append a line per record."""
        assert self._file is not None  # opened
        text = "".join(json.dumps(record) + "\n" for record in records)
        data = ("\n" * self._is_cut_off + text).encode()
        self._is_cut_off = self._file.write(data) != len(data)
        if self._is_cut_off:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def sync(self) -> None:
        """Wait until what was written is on the disk, where not even a power cut takes it away."""
        assert self._file is not None  # opened
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file; one that this journal made and never wrote to is removed."""
        if self._file is None:
            return
        is_unused = self._is_new and os.fstat(self._file.fileno()).st_size == 0
        self._file.close()
        self._file = None
        if is_unused:
            self.path.unlink(missing_ok=True)

    def _check_contents(self, file: FileIO) -> bool:
        """Check that a file is empty or of this kind; return whether its last line was cut off."""
        size = os.fstat(file.fileno()).st_size
        if size == 0:
            return False
        file.seek(0)
        if self._mark.encode() not in file.readline(1000):
            raise ForeignFileError(errno.EEXIST, "the file holds something else", str(self.path))
        file.seek(size - 1)
        return file.read(1) != b"\n"
