"""Tables of a TOML file as objects, every value checked against the type of its field."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from types import UnionType
from typing import Any, Self, get_args, get_origin

from lerobot_excav.errors import require

_PLAIN: Mapping[type, tuple[type | tuple[type, ...], str]] = {
    str: (str, "text"),
    int: (int, "whole number"),
    float: ((int, float), "number"),
}


@dataclass(frozen=True, kw_only=True)
class TomlTable:
    """A table whose keys are the fields of the class: plain values, tuples, mappings and other tables."""

    @classmethod
    def read(cls, table: Mapping[str, Any], place: str) -> Self:
        """Make an object of a table.

        Args:
            table: The table.
            place: What stands before its keys in messages.

        Raises:
            ConfigurationError: A key is unknown or missing, or a value is of another type.
        """
        types = {field.name: field.type for field in fields(cls)}
        needed = [field.name for field in fields(cls) if field.default is MISSING]
        for name in table:
            require(name in types, f"{place}{name} is not known; allowed: {', '.join(types)}")
        for name in needed:
            require(name in table, f"{place}{name} is missing; needed: {', '.join(needed)}")
        return cls(**{name: _checked(value, types[name], place + name) for name, value in table.items()})


def _checked(value: Any, kind: Any, name: str) -> Any:
    """Return a value as its field has it, or raise `ConfigurationError`."""
    if isinstance(kind, UnionType):  # `str | None`: there is no None in TOML
        kind = get_args(kind)[0]
    origin, inner = get_origin(kind), get_args(kind)
    if origin is tuple:
        require(isinstance(value, list), f"{name}={value!r} is no list")
        return tuple(_checked(item, inner[0], f"{name}[{number}]") for number, item in enumerate(value))
    if origin is Mapping or issubclass(kind, TomlTable):
        require(isinstance(value, dict), f"{name}={value!r} is no table")
        if origin is Mapping:
            return {key: _checked(item, inner[1], f"{name}.{key}") for key, item in value.items()}
        return kind.read(value, f"{name}.")
    allowed, word = _PLAIN[kind]
    # A truth value is an int in Python, and none in TOML.
    require(isinstance(value, allowed) and not isinstance(value, bool), f"{name}={value!r} is no {word}")
    return kind(value)
