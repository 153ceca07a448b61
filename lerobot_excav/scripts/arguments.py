"""Command lines made of dataclasses, in LeRobot's own words, by the parser that LeRobot uses."""

import argparse
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, override

import draccus
from draccus.argparsing import ArgumentParser
from draccus.help_formatter import SimpleHelpFormatter
from draccus.wrappers.docstring import HelpOrder

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.envs.tasks.setting import check_settings
from lerobot_excav.errors import ConfigurationError


@dataclass(kw_only=True)
class Arguments:
    """Base of the arguments of a command: every field is an option, except the one that stands first without a name.

    Raises:
        ConfigurationError: A field has a value that is not possible.
    """

    PREFIX: ClassVar[str] = "--"
    POSITIONAL: ClassVar[str] = ""
    """Name of the field that is given without a name, before all options: a path, or a list of texts."""

    def __post_init__(self) -> None:
        check_settings(self, self.PREFIX)
        getattr(super(), "__post_init__", lambda: None)()


class EnvironmentChoice(draccus.ChoiceRegistry):  # type: ignore[misc]  # draccus is untyped here
    """The settings of an environment, chosen by `--env.type` among those of the registry."""

    @classmethod
    @override
    def get_known_choices(cls) -> dict[str, Any]:
        for name, spec in env_types().items():
            if name not in cls._choice_registry:
                # The name stands in help and errors.
                choice = type(f"--env.type={name}", (spec.settings, cls), {"PREFIX": "--env."})
                choice.__doc__ = spec.settings.__doc__
                cls._choice_registry[name] = dataclass(kw_only=True)(choice)
        return dict(cls._choice_registry)

    @classmethod
    @override
    def get_choice_class(cls, name: str) -> Any:
        known = cls.get_known_choices()
        if name not in known:
            raise ConfigurationError(f"--env.type={name!r} is not known; allowed: {', '.join(known)}.")
        return known[name]

    @classmethod
    @override
    def default_choice_name(cls) -> str:
        return next(iter(cls.get_known_choices()))


def parse_arguments[Parsed: Arguments](
    kind: type[Parsed], argv: Sequence[str], *, command: str, description: str
) -> Parsed:
    """Parse a command line.

    Args:
        kind: What to make of it.
        argv: The command line, without the command.
        command: Name of the command, for usage and errors.
        description: What the command does, with examples.

    Raises:
        ConfigurationError: An option is unknown or has a value that is not possible.
        SystemExit: Help was asked for.
    """
    named = next((i for i, word in enumerate(argv) if word.startswith("-")), len(argv))
    first, options = list(argv[:named]), list(argv[named:])
    name = kind.POSITIONAL
    parser = ArgumentParser(
        kind,
        prog=f"lerobot-excav {command}",
        usage=f"lerobot-excav {command} {name.upper() + ' ' if name else ''}[--option=value ...]",
        description=description,
        formatter_class=_HelpFormatter,
        preferred_help=HelpOrder.below,
        exit_on_error=False,
    )
    try:
        parsed: Parsed = parser.parse_args(options)
    except (draccus.utils.DraccusException, argparse.ArgumentError) as error:
        raise ConfigurationError(f"{error}; `lerobot-excav {command} --help` lists the options") from None
    if first:
        _set_first(parsed, first, command)
    return parsed


def _set_first(parsed: Arguments, words: list[str], command: str) -> None:
    name = parsed.POSITIONAL
    if not name:
        raise ConfigurationError(
            f"{' '.join(words)!r} has no option before it; `lerobot-excav {command} --help` lists the options"
        )
    if typing.get_origin(typing.get_type_hints(type(parsed))[name]) is list:
        setattr(parsed, name, words)
    elif len(words) == 1:
        setattr(parsed, name, Path(words[0]))
    else:
        raise ConfigurationError(f"one {name} is needed, not {len(words)}: {' '.join(words)}")


class _HelpFormatter(SimpleHelpFormatter):  # type: ignore[misc]
    """LeRobot's formatter, without a default where there is none."""

    @override
    def _get_help_string(self, action: argparse.Action) -> str | None:
        return action.help if action.default is None else super()._get_help_string(action)
