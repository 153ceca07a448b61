"""What a mask source is told, from a file: `--env.mask_options=FILE`."""

import hashlib
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lerobot_excav.errors import ConfigurationError, require

ANY = "*"
"""Key of the entry for whatever has none of its own, in options that list entries."""


Share = Annotated[float, Field(ge=0.0, le=1.0)]
"""From nothing to all, as of a picture's width or of certainty."""


class MaskOptions(BaseModel):
    """Base of the options of a source; every one of them has a default."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def read_options[Options: MaskOptions](kind: type[Options], name: str, path: Path | None) -> Options:
    """Read the options of a source; of a file that is not given, all are as by default.

    Raises:
        ConfigurationError: The file cannot be read, names an option that does not exist, or gives it a wrong value.
    """
    try:
        return kind(**({} if path is None else _read(path)))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        allowed = ", ".join(kind.model_fields)
        raise ConfigurationError(
            f"mask_options={path}: {place or 'the file'}: {first['msg']}; the mask source {name!r} takes {allowed}"
        ) from error


def require_distinct(keys: Sequence[str], entries: str) -> None:
    """Check that no two entries of a file of options have the same key.

    Args:
        keys: Their keys.
        entries: What they are called.

    Raises:
        ConfigurationError: Two have.
    """
    twice = sorted({key for key in keys if keys.count(key) > 1})
    require(not twice, f"mask_options: two {entries} have the key {', '.join(twice)}; leave one out")


def options_words(path: Path) -> str:
    """Return what results say of a file of options: its name and a digest, for its place is nobody's business."""
    return f"{path.name} ({hashlib.sha256(path.read_bytes()).hexdigest()[:8]})"


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"mask_options={path} cannot be read ({error.strerror}); give a TOML file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"mask_options={path} is no TOML file: {error}") from error
