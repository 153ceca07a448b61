"""One process at a time: a lock that ends with its process, however that ends."""

import errno
import re
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from lerobot_excav.errors import DatasetError

_IMPOSSIBLE = {errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}
"""What file systems answer that have no locks. `filelock` copes with those that lack them by design (ENOSYS) itself."""


class RunLock:
    """Keeps other processes away from what a run is writing.

    Args:
        path: Lock file; it is made, and removed on release.
        place: What is locked, as messages name it.

    Raises:
        DatasetError: Another process holds the lock, nothing can be locked there, or the file is somebody else's.
    """

    def __init__(self, path: Path, place: Path) -> None:
        _require_lock_file(path)
        self._lock = FileLock(path)
        try:
            self._lock.acquire(timeout=0)
        except Timeout:
            raise DatasetError(f"another process is at work on {place}; wait for it, or stop it") from None
        except (OSError, NotImplementedError) as error:
            if isinstance(error, OSError) and error.errno not in _IMPOSSIBLE:
                raise
            raise DatasetError(
                f"{place} cannot be locked against a second process ({error}), as on some network drives; "
                "choose a folder on a disk of this machine, and copy the result"
            ) from error

    def release(self) -> None:
        """Let others in."""
        with suppress(OSError):  # Windows removes it on release, and not before
            Path(self._lock.lock_file).unlink(missing_ok=True)
        self._lock.release()


def _require_lock_file(path: Path) -> None:
    """Raise `DatasetError` if something else lies there: a lock is empty, or begins with the number of its process."""
    if path.is_file() and re.match(rb"\Z|\d+\s", path.read_bytes()) is None:
        raise DatasetError(f"{path} is needed as a lock and holds something else; move it elsewhere")
