"""Files that appear whole: readers find the old one or the new one, never half of one, even if the machine stops."""

import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_TEMPORARY = re.compile(r"\.(.+)\.[0-9a-f]{12}\.tmp")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Provide a new name beside `path` to write to; what was written takes the place of `path` when the block ends.

    The file that a symbolic link names is replaced, not the link. If the block fails, `path` stays as it was.

    Raises:
        OSError: The file cannot be written; it names `path`.
    """
    real = Path(os.path.realpath(path))
    temporary = real.with_name(f".{real.name}.{uuid.uuid4().hex[:12]}.tmp")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(real)
    except OSError as error:
        # A write that fails names no file, and nobody knows the temporary one.
        raise named(error, path) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes | memoryview) -> None:
    """Write a file in one piece, text as UTF-8.

    Raises:
        OSError: The file cannot be written; it names `path`.
    """
    with whole_file(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def named(error: OSError, path: Path) -> OSError:
    """Return an error that names the file it is about."""
    return OSError(error.errno, error.strerror or str(error), str(path))


def unfinished(path: Path) -> str | None:
    """Return the name of the file that a temporary one was to become when its process was killed; None for others."""
    match = _TEMPORARY.fullmatch(path.name)
    return match[1] if match else None
