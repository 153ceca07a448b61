"""The boundary to files that may be damaged: what a library says about one becomes an error that names it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lerobot_excav.errors import DatasetError, ExcavError

_LONGEST_CAUSE = 200  # characters; some libraries print both schemas


@contextmanager
def reading(what: Path | str) -> Iterator[None]:
    """Say what was being read when a library failed: `FILE cannot be read: CAUSE`.

    Only calls of libraries belong within. Over damaged bytes those for Parquet, pictures and videos raise a dozen kinds
    of errors, `SyntaxError` and `MemoryError` among them, so every kind is taken for damage.

    Raises:
        DatasetError: Whatever was raised, except the errors of this package, which say enough themselves.
    """
    try:
        yield
    except ExcavError:
        raise
    except FileNotFoundError as error:
        raise DatasetError(f"{what} is missing") from error
    except Exception as error:
        raise DatasetError(f"{what} cannot be read: {_in_a_line(error)}") from error


def _in_a_line(error: Exception) -> str:
    words = " ".join(str(error).split()) or type(error).__name__
    return words if len(words) <= _LONGEST_CAUSE else f"{words[:_LONGEST_CAUSE]} …"
