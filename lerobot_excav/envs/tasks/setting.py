"""A setting: a field of a dataclass that says what it means and which values it may have, once for all who use it.

Environments, simulated robots, recorded demonstrations and the command lines of all three are made of such fields. The
help text goes where draccus, LeRobot's command line parser, looks for it.
"""

import dataclasses
import math
import typing
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from numbers import Integral, Real
from pathlib import Path
from types import NoneType
from typing import Any

from lerobot_excav.errors import ConfigurationError

_METADATA_KEY = "setting"
_ENDLESS = 2**31 - 1  # limits from here on are there for files and clocks, and need not be told
_KIND_NAMES = {int: "a whole number", float: "a number", str: "a text", bool: "true or false", Path: "a path"}


@dataclass(frozen=True, kw_only=True)
class Allowed:
    """Which values a setting may have, beyond those of its type.

    Attributes:
        choices: All of them, or a function that lists them where other packages add some; None: any in range.
        low: Least value.
        high: Greatest value.
        also: Another type whose values all do, where Python code and not a command line gives them.
        hint: What to do about a wrong one, added to the message.
        is_column: Whether datasets have a column `excav.<name>` of it.
        changes_start: Whether the same scene starts otherwise under another value.
    """

    choices: Collection[Any] | Callable[[], Collection[Any]] | None = None
    low: float | None = None
    high: float | None = None
    also: type | None = None
    hint: str = ""
    is_column: bool = False
    changes_start: bool = False

    @property
    def values(self) -> tuple[Any, ...] | None:
        """All allowed values, if they can be listed."""
        choices = self.choices() if callable(self.choices) else self.choices
        return None if choices is None else tuple(choices)

    @property
    def words(self) -> str:
        """The allowed values in words."""
        if self.values is not None:
            return "one of " + ", ".join(map(str, self.values))
        if self.low is not None:
            endless = self.high is None or self.high >= _ENDLESS
            return f"from {self.low} on" if endless else f"from {self.low} to {self.high}"
        return ""


def setting(meaning: str, *, default: Any, **allowed: Any) -> Any:
    """Declare a field with its meaning and its allowed values.

    Args:
        meaning: What it is, with its unit, as `--help` shows it.
        default: Its value unless another is given; `dataclasses.MISSING` if there is none.
        allowed: Fields of `Allowed`.
    """
    limits = Allowed(**allowed)
    # What other packages add is not known yet.
    words = "" if callable(limits.choices) else limits.words
    text = f"{meaning}. Allowed: {words}" if words else meaning
    # argparse formats help texts with the percent operator.
    custom_args: dict[str, Any] = {"help": text.replace("%", "%%")}
    if isinstance(default, bool):
        custom_args |= {"nargs": "?", "const": "true"}  # `--resume` means `--resume=true`
    return field(default=default, metadata={_METADATA_KEY: limits, "custom_args": custom_args}, kw_only=True)


def with_default(cls: type, name: str, default: Any) -> Any:
    """Declare an inherited setting again with a default of one's own."""
    inherited = next(f for f in dataclasses.fields(cls) if f.name == name)
    return field(default=default, metadata=inherited.metadata, kw_only=True)


def declared_settings(cls: type) -> dict[str, Allowed]:
    """Return what the settings of a dataclass allow, by name."""
    fields = dataclasses.fields(cls)
    return {f.name: f.metadata[_METADATA_KEY] for f in fields if _METADATA_KEY in f.metadata}


def check_settings(settings: Any, prefix: str = "") -> None:
    """Check every setting of a dataclass, before whose names the user writes a prefix such as `env.`.

    Raises:
        ConfigurationError: A value is of another type or not allowed; the message names the field.
    """
    types = typing.get_type_hints(type(settings))
    for name, allowed in declared_settings(type(settings)).items():
        value = getattr(settings, name)
        _check(f"{prefix}{name}", value, types[name], allowed)
        if isinstance(value, Real) and not isinstance(value, int | float):
            # NumPy's own numbers do not go into JSON.
            setattr(settings, name, int(value) if isinstance(value, Integral) else float(value))


def _check(name: str, value: Any, kind: Any, allowed: Allowed) -> None:
    kinds = typing.get_args(kind) or (kind,)
    if (value is None and NoneType in kinds) or (allowed.also and isinstance(value, allowed.also)):
        return
    if not any(_is_of(value, each) for each in kinds) or not _is_allowed(value, allowed):
        names = [_KIND_NAMES.get(each, each.__name__) for each in kinds if each is not NoneType]
        is_number = isinstance(value, Real)
        is_beyond = is_number and allowed.high is not None and value > allowed.high
        limits = f"from {allowed.low} to {allowed.high}" if is_beyond else allowed.words
        wanted = limits if allowed.values is not None else f"{' or '.join(names)} {limits}"
        raise ConfigurationError(f"{name}={value!r} is not possible; give {wanted.strip()}. {allowed.hint}".rstrip())


def _is_of(value: Any, kind: Any) -> bool:
    """Tell whether a value is of a type; a truth value is no number, and a number has to be finite."""
    if kind is bool or isinstance(value, bool):
        return kind is bool and isinstance(value, bool)
    if kind is int:
        return isinstance(value, Integral)
    if kind is float:
        return isinstance(value, Integral) or (isinstance(value, Real) and math.isfinite(value))
    if kind is Path:
        return isinstance(value, str | Path)
    return isinstance(value, kind) if isinstance(kind, type) else True


def _is_allowed(value: Any, allowed: Allowed) -> bool:
    if allowed.values is not None:
        return value in allowed.values
    is_number = isinstance(value, Real)
    if not is_number:
        return True
    return (allowed.low is None or value >= allowed.low) and (allowed.high is None or value <= allowed.high)
