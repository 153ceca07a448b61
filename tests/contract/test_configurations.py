"""Every field of every configuration takes what its page allows, and refuses anything else by name, at once."""

import dataclasses
import math

import draccus
import pytest
from draccus.cfgparsing import parse_string

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.scripts.arguments import parse_arguments
from lerobot_excav.scripts.main import COMMANDS

from . import field_rules
from .field_rules import (
    COMMAND_TABLES,
    CONFIGURATIONS,
    DERIVED,
    ENDLESS,
    LEROBOTS_OWN,
    POOL,
    Rule,
    each,
    number,
    one_of,
    path,
    problem,
    problems,
    text,
    whole,
)


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_every_field_is_in_the_table(name):
    kind, table, _ = CONFIGURATIONS[name]
    known = {field.name for field in dataclasses.fields(kind)}
    assert known - {"env", "mask", *DERIVED, *LEROBOTS_OWN} - (
        {"env"} if name != "lerobot-excav export" else set()
    ) <= set(table)
    assert set(table) <= known


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_field_takes_what_is_harmless_and_refuses_the_rest_by_name(name):
    found = problems(*CONFIGURATIONS[name])
    assert found == [], "\n".join(found)


NESTED = "9" * 5000
TEXTS = {
    **{"nan": math.nan, "1e400": math.inf, "-0": 0, "7": 7, "-1": -1, "2.5": 2.5, "true": True, "false": False},
    **{"null": None, "typo": "typo", "[]": [], "[1]": [1], "[nan]": [math.nan], "{}": {}, "": "", "9" * 30: 10**30 - 1},
    NESTED: 10**5000,
}
"""What stands on a command line, and what it means where a number, a list or a truth value is asked for."""


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_takes_what_is_harmless_and_refuses_the_rest_by_name(command):
    kind, table, _ = CONFIGURATIONS[f"lerobot-excav {command}"]
    found = []
    for name, rule in table.items():
        if command in ("operator", "bench") and (name, rule) in COMMAND_TABLES["demos"].items():
            continue  # the same option, tried there
        for word, meaning in TEXTS.items():
            if name == "metrics" and meaning and isinstance(meaning, list):
                continue  # files called 1 and nan
            value = meaning if word in ("", "null") or not rule.is_text else word
            needs = [f"--{key}={need}" for key, need in rule.needs.items()]
            wrong = problem(
                lambda argv=[*needs, f"--{name}={word}"]: parse_arguments(kind, argv, command=command, description=""),
                is_harmless=rule.allows(value),
                name=name,
            )
            if wrong is not None:
                found.append(f"--{name}={word:.40}: {wrong}")
    assert found == [], "\n".join(found)


@pytest.mark.parametrize("name", [name for name in CONFIGURATIONS if name not in ("soil", "demonstrations")][:8])
def test_lerobots_parser_leaves_nothing_harmful(name):
    """Its own reading of a text stands: it makes 1 of `true`, and text of anything."""
    kind, table, base = CONFIGURATIONS[name]
    found = []
    for field, rule in table.items():
        for word, meaning in TEXTS.items():
            if rule.is_text or word in (NESTED, "true", "false") or not (rule.allows(meaning) or is_wrong(meaning)):
                continue
            wrong = problem(
                lambda field=field, rule=rule, word=word: draccus.decode(
                    kind, {**base, **rule.needs, field: parse_string(word)}
                ),
                is_harmless=rule.allows(meaning),
                name=field,
            )
            if wrong is not None:
                found.append(f"{field}={word:.40}: {wrong}")
    assert found == [], "\n".join(found)


def is_wrong(meaning):
    """Tell whether a value is wrong in every field that does not allow it, however it is read."""
    return isinstance(meaning, float | int | dict)


PAGE = {"title": "t", "metrics": "m"}
ROW = {"label": "a", "about": "x"}
file_name = Rule(
    lambda v: isinstance(v, str) and v != "" and not set(v) & set("/\\\0\n") and v[0] != ".",
    ("a b", "../a", "a/b", ".a", "..", "\\a", "a\nb"),
)
any_text = Rule(lambda v: isinstance(v, str), is_text=True)
LISTS = Rule(lambda v: v == [])
PAGE_TABLES = {
    "title": (text, lambda v: {**PAGE, "title": v}),
    "metrics": (path, lambda v: {**PAGE, "metrics": v}),
    "text": (any_text, lambda v: {**PAGE, "text": v}),
    **{name: (LISTS, lambda v, name=name: {**PAGE, name: v}) for name in ("section", "curve", "clips")},
    "label": (file_name, lambda v: page({**ROW, "label": v})),
    "about": (text, lambda v: page({**ROW, "about": v})),
    "success": (number(), lambda v: page({**ROW, "paper": {"success": v}})),
    "reference": (one_of("a"), lambda v: page(ROW, reference=v)),
    "rows": (LISTS, lambda v: {**PAGE, "section": [{"title": "s", "rows": v}]}),
    "folder": (
        Rule(lambda v: isinstance(v, str) and "\0" not in v and v not in ("", "..", "/", "c/.."), ("a/c", "/", "c/..")),
        lambda v: {**PAGE, "curve": [{"label": "c", "folder": v}]},
    ),
    "episodes": (each(whole(0, ENDLESS)), lambda v: {**page(ROW), "clips": [{"label": "a", "episodes": v}]}),
}


def page(row, **section):
    return {**PAGE, "section": [{"title": "s", "rows": [row], **section}]}


def as_toml(value):
    """Write a value as TOML; None if TOML has no such value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) > 10**4000:
        return "9" * 5000
    if isinstance(value, int | float):
        return f"{value}"
    if isinstance(value, str):
        escaped = "".join(f"\\u{ord(c):04x}" if c < " " or c in '"\\' else c for c in value)
        return f'"{escaped}"'
    if isinstance(value, list | tuple):
        parts = [as_toml(part) for part in value]
        return None if None in parts else f"[{', '.join(parts)}]"
    if isinstance(value, dict):
        parts = {key: as_toml(part) for key, part in value.items()}
        return None if None in parts.values() else "{" + ", ".join(f"{k} = {v}" for k, v in parts.items()) + "}"
    return None


@pytest.mark.parametrize("field", PAGE_TABLES)
def test_a_field_of_a_result_page_takes_what_is_harmless_and_refuses_the_rest_by_name(field, tmp_path):
    rule, contents = PAGE_TABLES[field]
    file, found = tmp_path / "rows.toml", []
    values = {**POOL, **{f"example {place}": value for place, value in enumerate(rule.examples)}}
    for label, value in values.items():
        words = {key: as_toml(part) for key, part in contents(value).items()}
        if None in words.values():
            continue
        file.write_text("".join(f"{key} = {part}\n" for key, part in words.items()))
        name = "rows.toml" if "10^5000" in label else field
        wrong = problem(lambda: read_contents(file), is_harmless=rule.allows(value), name=name)
        if wrong is not None:
            found.append(f"{field} = {label}: {wrong}")
    assert found == [], "\n".join(found)


def faulty(take):
    """A configuration whose only field is taken in a faulty way."""

    class Faulty:
        def __init__(self, size):
            take(size)

    return Faulty


def hang(size):
    while size == 1:
        pass


def refuse(message):
    def take(size):
        raise ConfigurationError(message.format(size=size))

    return take


@pytest.mark.parametrize(
    ("take", "found"),
    [
        (lambda size: None, "size = nan: accepted though harmful"),
        (lambda size: int(size), "size = nan: raw ValueError"),
        (refuse("size={size} is not possible"), "size = 1: refused though harmless"),
        (refuse("this is not possible"), "size = nan: the refusal does not name field and value"),
        (refuse("size is not possible"), "size = nan: the refusal does not name field and value"),
        (hang, "size = 1: hangs"),
    ],
)
def test_a_planted_fault_is_found(monkeypatch, take, found):
    monkeypatch.setattr(field_rules, "CPU_LIMIT_S", 0.1)
    pool = {label: POOL[label] for label in ("1", "nan")}
    monkeypatch.setattr(field_rules, "POOL", pool)
    table = {"size": Rule(whole(0, 9).allows)}
    assert any(line.startswith(found) for line in problems(faulty(take), table, {}))
