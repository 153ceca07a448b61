"""Command lines: every option is explained, takes what it says, and is refused by its name with anything else."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar

import pytest
import toy_reach  # noqa: F401 - registers the example task
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.scripts.arguments import Arguments, parse_arguments
from lerobot_excav.scripts.main import COMMANDS, main, module_of
from lerobot_excav.setting import declared_settings, setting

COMMAND_ARGUMENTS = {name: module_of(name).ARGUMENTS for name in COMMANDS}


@dataclass(kw_only=True)
class Lunch(Arguments):
    POSITIONAL: ClassVar[str] = "table"

    table: Path | None = setting("Where", default=None)
    guest: str = setting("Who comes", default="anybody")
    dish: str = setting("What", default="soup", choices=("soup", "rice"))
    plates: int = setting("How many, 100 % of them clean", default=1, low=1, high=9)
    hot: bool = setting("Whether it is hot", default=False)


def parse(*argv, kind=Lunch, command="lunch"):
    return parse_arguments(kind, argv, command=command, description="Eat.")


@pytest.mark.parametrize(
    ("argv", "expected"),
    [
        ([], Lunch()),
        (["t"], Lunch(table=Path("t"))),
        (["t", "--dish=rice", "--plates=3", "--hot=true"], Lunch(table=Path("t"), dish="rice", plates=3, hot=True)),
        (["--plates", "3", "--hot"], Lunch(plates=3, hot=True)),
        (["--hot", "--plates=3"], Lunch(plates=3, hot=True)),
        (["--hot=false"], Lunch()),
        (["--table=007"], Lunch(table=Path("007"))),
        (["--table=1e3", "--guest", "true"], Lunch(table=Path("1e3"), guest="true")),
        (["--guest=2026-01-01"], Lunch(guest="2026-01-01")),
        (["--guest='a'"], Lunch(guest="a")),
        (['--guest="Best" friend'], Lunch(guest='"Best" friend')),
        (["--guest=a: [b", "--table", "@c"], Lunch(guest="a: [b", table=Path("@c"))),
    ],
)
def test_words_become_arguments(argv, expected):
    assert parse(*argv) == expected


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["--dessert=3"], r"unrecognized arguments: --dessert=3; `lerobot-excav lunch --help` lists the options"),
        (["--plate=3"], "unrecognized arguments: --plate=3"),  # no guessing of shortened names
        (["--plates"], "--plates: expected one argument"),
        (["--plates="], "--plates= has no value after it"),
        (["--table="], "--table= has no value after it"),
        (["--plates=true"], "--plates=true is not possible"),
        (["--plates", "true"], "--plates=true is not possible"),
        (["--table=include_x"], "--table=include_x is not possible: write ./include_x"),
        (["--plates=10"], "--plates=10 is not possible; give a whole number from 1 to 9"),
        (["--plates=2.5"], "plates.*Couldn't parse '2.5' into an int"),
        (["--dish=stone"], "--dish='stone' is not possible; give one of soup, rice"),
        (["--dish=["], r"--dish='\[' is not possible; give one of soup, rice"),
        (["--dish=--"], "--dish='--' is not possible; give one of soup, rice"),
        (["--plates=["], r"--plates='\[' cannot be read"),
        (["--plates=--"], "--plates='--' cannot be read"),
        (["--hot=very"], "hot.*Couldn't parse 'very' into a bool"),
        (["a", "--table=b"], "table is given twice"),
        (["a", "b"], "one table is needed, not 2: a b"),
        (["--plates=3", "a"], "unrecognized arguments: a"),
    ],
)
def test_what_cannot_be_parsed_is_named(argv, message):
    with pytest.raises(ConfigurationError, match=message):
        parse(*argv)


def test_a_word_before_the_options_of_a_command_without_one_is_refused():
    with pytest.raises(ConfigurationError, match="'x' has no option before it"):
        parse("x", kind=COMMAND_ARGUMENTS["demos"], command="demos")


@pytest.mark.parametrize("command", COMMANDS)
def test_help_explains_every_option_with_its_allowed_values(command, capsys):
    kind = COMMAND_ARGUMENTS[command]
    with pytest.raises(SystemExit) as exit_info:
        main([command, "--help"])
    assert exit_info.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"Examples: lerobot-excav {command}" in text
    described = [("--", kind)]
    if command in ("demos", "operator", "bench"):
        assert f"--env.type {{{','.join(env_types())}}}" in text
        described += [("--env.", spec.settings) for spec in env_types().values()]
    for prefix, cls in described:
        for name, allowed in declared_settings(cls).items():
            assert f"{prefix}{name} " in text
            assert callable(allowed.choices) or not allowed.words or f"Allowed: {allowed.words}" in text
    assert "type: ignore" not in text


def test_an_environment_is_chosen_with_its_own_settings():
    kind, toy = COMMAND_ARGUMENTS["demos"], "--env.type=toy_reach"
    parsed = parse(toy, "--env.table=ice", "--env.fps=5", "--scenes=2", kind=kind)
    assert (parsed.env.ENV_TYPE, parsed.env.table, parsed.env.fps, parsed.scenes) == ("toy_reach", "ice", 5, 2)
    with pytest.raises(ConfigurationError, match=r"`soil` are not valid for --env.type=toy_reach"):
        parse(toy, "--env.soil=sand", kind=kind)
    with pytest.raises(ConfigurationError, match=r"'lathe'.*'excavator', 'fr5_grasp', 'toy_reach'"):
        parse("--env.type=lathe", kind=kind)


@pytest.mark.parametrize("option", ["mask_condition=zero", "target_overlay=true", "observation_height=32"])
def test_the_operator_takes_no_option_about_pictures(option):
    with pytest.raises(ConfigurationError, match=rf"--env\.{option.split('=')[0]}=\S+ has no effect"):
        parse(f"--env.{option}", kind=COMMAND_ARGUMENTS["operator"], command="operator")


BAD_TEXTS = r"0 -1 nan inf 1e400 null true typo [ [1,a] {} *x 2026-01-01 2026-13-45 @ !!python/object:x a:b \ ' --"
bad_texts = st.sampled_from([*BAD_TEXTS.split(), "", "a: b", "\x00", "9" * 30, "9" * 5000]) | st.text(max_size=6)

OPTIONS = [
    (command, "", field.name)
    for command, kind in COMMAND_ARGUMENTS.items()
    for field in fields(kind)
    if field.name not in ("env", kind.POSITIONAL)
] + [("demos", env_type, name) for env_type, spec in env_types().items() for name in declared_settings(spec.settings)]


@settings(max_examples=200)
@given(option=st.sampled_from(OPTIONS), text=bad_texts)
def test_a_bad_value_is_refused_in_one_line_by_the_name_of_its_option(option, text):
    command, env_type, name = option
    argv = [f"--env.type={env_type}", f"--env.{name}={text}"] if env_type else [f"--{name}={text}"]
    try:
        parse(*argv, kind=COMMAND_ARGUMENTS[command], command=command)
    except ConfigurationError as error:
        problem = str(error)
    else:
        return
    assert name in problem
    assert "\n" not in problem
