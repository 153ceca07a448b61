"""A setting: a field of a dataclass that says what it means and which values it may have, once for all who use it.

Environments, simulated robots, policies, recorded demonstrations and all their command lines are made of such fields.
The help text goes where draccus, LeRobot's command line parser, looks for it.
"""

import dataclasses
import functools
import math
import sys
import typing
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from numbers import Integral, Real
from pathlib import Path
from types import NoneType
from typing import Any

from lerobot_excav.errors import ConfigurationError, shown

_METADATA_KEY = "setting"
_ENDLESS = 2**31 - 1  # limits from here on are there for files and clocks, and need not be told
_LARGEST_INTEGER = 2**63 - 1
_LARGEST_FLOAT = sys.float_info.max
_KIND_NAMES = {int: "a whole number", float: "a number", str: "a text", bool: "true or false", Path: "a path"}


@dataclass(frozen=True, kw_only=True)
class Allowed:
    """Which values a setting may have, beyond those of its type; of a list or a mapping, each of its values.

    Attributes:
        choices: All of them, or a function that lists them where other packages add some; None: any in range.
        low: Least value.
        high: Greatest value; without one, a number is finite and a whole number fits 64 bits.
        above: Value that it has to exceed.
        below: Value that it has to stay under.
        also: Another type whose values all do, where Python code and not a command line gives them.
        hint: What to do about a wrong one, added to the message.
        is_column: Whether datasets have a column `excav.<name>` of it.
        changes_start: Whether the same scene starts otherwise under another value.
    """

    choices: Collection[Any] | Callable[[], Collection[Any]] | None = None
    low: float | None = None
    high: float | None = None
    above: float | None = None
    below: float | None = None
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
        return self.words_for(None)

    def words_for(self, value: Any) -> str:
        """Say in words what is allowed; a limit that need not be told is told to whoever exceeded it."""
        if self.values is not None:
            return "one of " + ", ".join(map(str, self.values))
        low = f"from {self.low}" if self.low is not None else f"above {self.above}" if self.above is not None else ""
        if self.below is not None:
            return f"{low} to below {self.below}".strip()
        high = _LARGEST_INTEGER if self.high is None else self.high
        if high < _ENDLESS or (isinstance(value, Integral) and not _lies(value, -math.inf, high)):
            return f"{low} to {high}".strip()
        return f"{low} on" if self.low is not None else low

    def is_in_range(self, value: Any) -> bool:
        """Tell whether a value is one of the choices, or a number within the limits."""
        if self.values is not None:
            return value in self.values
        if not _is_number(value):
            return True
        return (
            (self.low is None or value >= self.low)
            and (self.high is None or value <= self.high)
            and (self.above is None or value > self.above)
            and (self.below is None or value < self.below)
        )


def setting(meaning: str, *, default: Any = dataclasses.MISSING, default_factory: Any = None, **allowed: Any) -> Any:
    """Declare a field with its meaning and its allowed values.

    Args:
        meaning: What it is, with its unit, as `--help` shows it.
        default: Its value unless another is given.
        default_factory: Makes that value, where it is a list or a mapping.
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
    metadata = {_METADATA_KEY: limits, "custom_args": custom_args}
    if default_factory is not None:
        return field(default_factory=default_factory, metadata=metadata, kw_only=True)
    return field(default=default, metadata=metadata, kw_only=True)


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
    types = _type_hints(type(settings))  # type: ignore[arg-type]  # a class can be hashed
    for name, allowed in declared_settings(type(settings)).items():
        value = getattr(settings, name)
        _check(f"{prefix}{name}", value, types[name], allowed)
        if isinstance(value, Real) and not isinstance(value, int | float):
            # NumPy's own numbers do not go into JSON.
            setattr(settings, name, int(value) if isinstance(value, Integral) else float(value))


_type_hints = functools.cache(typing.get_type_hints)


def _check(name: str, value: Any, kind: Any, allowed: Allowed) -> None:
    kinds = _alternatives(kind)
    if (value is None and NoneType in kinds) or (allowed.also and isinstance(value, allowed.also)):
        return
    if any(_is_of(value, each) for each in kinds) and all(map(allowed.is_in_range, _members(value))):
        return
    words = dict.fromkeys(_words(each, allowed.words_for(value)) for each in kinds if each is not NoneType)
    raise ConfigurationError(
        f"{name}={shown(value)} is not possible; give {' or '.join(words)}. {allowed.hint}".rstrip()
    )


def _alternatives(kind: Any) -> tuple[Any, ...]:
    """Return the types of a union; any other type alone."""
    is_container = typing.get_origin(kind) in (list, dict)
    return (kind,) if is_container else typing.get_args(kind) or (kind,)


def _members(value: Any) -> Collection[Any]:
    """Return the values of a list or a mapping; any other value alone."""
    if isinstance(value, Mapping):
        return value.values()
    return value if isinstance(value, list | tuple) else (value,)


def _words(kind: Any, limits: str) -> str:
    """Say in words what values of a type within limits are."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is list:
        return f"a list, each {_words(parts[0], limits)}"
    if origin is dict:
        return f"names, each with {_words(parts[1], limits)}"
    name = _KIND_NAMES.get(kind, getattr(kind, "__name__", kind))
    return limits if limits.startswith("one of") else f"{name} {limits}".strip()


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _lies(value: Any, low: float, high: float) -> bool:
    """Tell whether a number lies within limits; what is not a number does not."""
    return bool(low <= value <= high)


def _is_of(value: Any, kind: Any) -> bool:
    """Tell whether a value is of a type; a truth value is no number, and a number has to be finite."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is list:
        return isinstance(value, list | tuple) and all(_is_of(each, parts[0]) for each in value)
    if origin is dict:
        pairs = value.items() if isinstance(value, Mapping) else [(None, None)]
        return all(_is_of(name, parts[0]) and _is_of(each, parts[1]) for name, each in pairs)
    if kind is bool or isinstance(value, bool):
        return kind is bool and isinstance(value, bool)
    if kind is int:
        return isinstance(value, Integral) and _lies(value, -_LARGEST_INTEGER, _LARGEST_INTEGER)
    if kind is float:
        return isinstance(value, Real) and _lies(value, -_LARGEST_FLOAT, _LARGEST_FLOAT)
    if kind is Path:
        return isinstance(value, str | Path) and str(value) != "" and "\0" not in str(value)
    return isinstance(value, kind) and value != ""
