"""Errors of the package: each names the field, the value, what is allowed and the next step."""

from collections.abc import Collection
from numbers import Integral
from typing import Any


class ExcavError(Exception):
    """Base of every error that this package raises on purpose."""


class ConfigurationError(ExcavError):
    """A setting, an argument or an input has a value that cannot be used.

    Not a ValueError: LeRobot's command line parser replaces those by a message that does not name the setting.
    """


class DatasetError(ExcavError, ValueError):
    """A dataset on disk lacks something that the operation needs."""


class DeviceError(ExcavError, RuntimeError):
    """A device (joystick, simulated robot) is missing, lost or used out of turn."""


class RenderingError(ExcavError, RuntimeError):
    """Pictures cannot be made on this machine."""


def shown(value: Any, *, most: int = 200) -> str:
    """Return a value as messages show it: on one line, cut where it is long, whatever it is."""
    try:
        text = repr(value)
    except Exception:  # a whole number of thousands of digits, or a class of somebody else
        return f"<{type(value).__name__}>"
    text = " ".join(text.split())
    return text if len(text) <= most else f"{text[:most]}..."


def require_choice(field: str, value: Any, allowed: Collection[Any], *, hint: str = "") -> None:
    """Raise unless a value is one of the allowed ones.

    Args:
        field: Name of the setting as its user writes it.
        value: The value given.
        allowed: Every value that would do.
        hint: Next step, added to the message.

    Raises:
        ConfigurationError: `value` is not in `allowed`.
    """
    if value not in allowed:
        names = ", ".join(repr(a) for a in allowed)
        raise ConfigurationError(f"{field}={shown(value)} is not known; allowed: {names}. {hint}".rstrip())


def require(condition: bool, message: str) -> None:  # noqa: FBT001 - reads as an assertion
    """Raise `ConfigurationError(message)` unless the condition holds."""
    if not condition:
        raise ConfigurationError(message)


def require_integer(field: str, value: Any, low: int, high: int | None = None, *, hint: str = "") -> None:
    """Raise unless a value is a whole number within limits; a truth value is none.

    Args:
        field: Name of the setting as its user writes it.
        value: The value given.
        low: Least allowed value.
        high: Greatest allowed value; None for no limit.
        hint: Next step, added to the message.

    Raises:
        ConfigurationError: `value` is not a whole number from `low` to `high`.
    """
    is_integer = isinstance(value, Integral) and not isinstance(value, bool)
    limits = f"from {low} on" if high is None else f"from {low} to {high}"
    require(
        is_integer and value >= low and (high is None or value <= high),
        f"{field}={shown(value)} is not possible; give a whole number {limits}. {hint}".rstrip(),
    )
