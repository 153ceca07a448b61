"""Command lines made of dataclasses, in LeRobot's own words, by the parser that LeRobot uses."""

import argparse
import dataclasses
import itertools
import json
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, override

import draccus
from draccus.argparsing import ArgumentParser
from draccus.cfgparsing import parse_string
from draccus.help_formatter import SimpleHelpFormatter
from draccus.wrappers.docstring import HelpOrder

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.setting import check_settings, with_default


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

    def given(self, name: str, what: str) -> Any:
        """Return the value of an option that has no default.

        Raises:
            ConfigurationError: It is missing; `what` is what to give.
        """
        value = getattr(self, name)
        option = name if name == self.POSITIONAL else f"--{name}"
        require(value is not None, f"{option} is missing; give {what}")
        return value


class _Environments:
    """The settings of an environment, chosen by `--env.type` among those of the registry."""

    _choice_registry: ClassVar[dict[str, Any]]
    DEFAULTS: ClassVar[dict[str, str]] = {}
    """What is set otherwise than the settings themselves say, unless the user does."""

    @classmethod
    def default(cls) -> Any:
        """Return the settings of the first environment."""
        return cls.get_choice_class(cls.default_choice_name())()

    @classmethod
    def get_known_choices(cls) -> dict[str, Any]:
        for name, spec in env_types().items():
            if name not in cls._choice_registry:
                # The name stands in help and errors.
                parts = {
                    "PREFIX": "--env.",
                    "__doc__": spec.settings.__doc__,
                    "__annotations__": dict.fromkeys(cls.DEFAULTS, str),
                    **{field: with_default(spec.settings, field, value) for field, value in cls.DEFAULTS.items()},
                }
                choice = type(f"--env.type={name}", (spec.settings, cls), parts)
                cls._choice_registry[name] = dataclass(kw_only=True)(choice)
        return dict(cls._choice_registry)

    @classmethod
    def get_choice_class(cls, name: str) -> Any:
        known = cls.get_known_choices()
        require_choice("--env.type", name, tuple(known))
        return known[name]

    @classmethod
    def default_choice_name(cls) -> str:
        return next(iter(cls.get_known_choices()))


class EnvironmentChoice(_Environments, draccus.ChoiceRegistry):  # type: ignore[misc]  # draccus is untyped here
    """Any environment."""


class EvaluationChoice(_Environments, draccus.ChoiceRegistry):  # type: ignore[misc]
    """Any environment, on the scenes that reports are made of."""

    DEFAULTS = {"scene_set": "test"}  # noqa: RUF012 - declared above


def parse_arguments[Parsed: Arguments](
    kind: type[Parsed], argv: Sequence[str], *, command: str, description: str
) -> Parsed:
    """Parse a command line, without the command itself; `description` says what that does, with examples.

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
    help_hint = f"`lerobot-excav {command} --help` lists the options"
    options = _with_texts_quoted(kind, options)
    for word in options:
        _require_readable(word, help_hint)
    try:
        parsed: Parsed = parser.parse_args(options)
        _require_no_truth_for_numbers(parsed, options)
    except (draccus.utils.DraccusException, argparse.ArgumentError) as error:
        # A setting of the environment that is not possible says so itself.
        if isinstance(error.__cause__, ConfigurationError):
            raise error.__cause__ from None
        raise ConfigurationError(f"{' '.join(str(error).split())}; {help_hint}") from None
    if first:
        _set_first(parsed, first, command)
    return parsed


def _require_readable(word: str, hint: str) -> None:
    """Raise unless the value of an option is YAML, which draccus takes it for; argparse loses the value `--`."""
    name, equals, text = word.partition("=") if word.startswith("-") else ("", "", word)
    require(bool(text) or not equals, f"{word} has no value after it; leave it out; {hint}")
    # draccus would read the rest of such a word as the name of a file with settings.
    plain = text.strip("'\"")
    require(not plain.startswith("include"), f"{name}={plain} is not possible: write ./{plain} for a file of this name")
    try:
        parse_string("[" if text == "--" else text)
    except Exception as error:  # whatever YAML takes offence at
        problem = " ".join(str(error).split())
        raise ConfigurationError(f"{name}={text!r} cannot be read ({problem}); {hint}") from None


def _with_texts_quoted(kind: type[Arguments], options: Sequence[str]) -> list[str]:
    """Return the options with texts and paths in quotes: YAML makes 7 of `007`, and 1000.0 of `1e3`."""
    types = typing.get_type_hints(kind)
    words = list(options)
    for number, word in enumerate(options):
        name, equals, text = word.partition("=")
        taken_as = _type_of(types, name.removeprefix("--").split("."))
        if not {str, Path} & {taken_as, *typing.get_args(taken_as)} or typing.get_origin(taken_as) is list:
            continue
        if equals:
            words[number] = f"{name}={_quoted(text)}"
        elif not "".join(options[number + 1 : number + 2]).startswith("--"):
            words[number + 1 : number + 2] = map(_quoted, options[number + 1 : number + 2])
    return words


def _type_of(types: Mapping[str, Any], path: Sequence[str]) -> Any:
    """Return the type of an option, which may be one of a part: `mask.text`; None if it is not known here."""
    first, *rest = path
    kind = types.get(first)
    if not rest:
        return kind
    return _type_of(typing.get_type_hints(kind), rest) if dataclasses.is_dataclass(kind) else None


def _quoted(text: str) -> str:
    is_quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "'\""
    is_as_it_is = is_quoted or text in ("", "null")
    return text if is_as_it_is else json.dumps(text, ensure_ascii=False)


def _require_no_truth_for_numbers(parsed: Arguments, options: Sequence[str]) -> None:
    """Raise where `true` was given for a number: draccus makes 1 of it."""
    for word, following in itertools.pairwise([*options, ""]):
        name, equals, text = word.partition("=")
        text = text if equals else following
        field: Any = parsed
        for part in name.strip("-").split("."):
            field = getattr(field, part, None)
        is_number = isinstance(field, int | float) and not isinstance(field, bool)
        require(
            not (is_number and name.startswith("--") and isinstance(parse_string(text), bool)),
            f"{name}={text} is not possible; true and false are not numbers",
        )


def _set_first(parsed: Arguments, words: list[str], command: str) -> None:
    name = parsed.POSITIONAL
    if not name:
        raise ConfigurationError(
            f"{' '.join(words)!r} has no option before it; `lerobot-excav {command} --help` lists the options"
        )
    require(getattr(parsed, name) in (None, []), f"{name} is given twice, before the options and as --{name}")
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
