"""What the pages say is so: links, files, modules, commands, options, tables, examples."""

import ast
import doctest
import importlib
import re
import shlex
import textwrap
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from pkgutil import resolve_name

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
TEXTS = {str(page.relative_to(ROOT)): page.read_text() for page in PAGES}

# What a reader adds by following a page, and what stands for it here. None: left out.
INVENTED = {
    "--env.type=toy_reach": "--env.type=excavator",
    "--env.table=ice": None,
    "--env.soil=clay": "--env.soil=sand",
    "--env.mask_source=redness": "--env.mask_source=oracle",
    "--policy.mask_strength=2": None,
}
INVENTED_FILES = {"lerobot_env_redness.py"}

OLDER_WORDS = (
    *("--env=", "bench soil", "bench operator", "bench fuzz", "lerobot-excav experiment", "stages.toml"),
    *("--target-rule", "--keep-failures", "--eval-fraction", "--skip-restarted", "--include-failures"),
    *("--scene-set", "--first-scene", "version 1", " anew", "it is not so"),
)


def blocks(text, language):
    return [
        textwrap.dedent(code)
        for code in re.findall(rf"^ *```{language}\n(.*?)^ *```$", text, flags=re.DOTALL | re.MULTILINE)
    ]


def commands(text):
    """The commands of LeRobot and of this package in a page, as words; those in `$(...)` besides."""
    shown = "\n".join(blocks(text, "bash")).replace("\\\n", " ")
    inside = re.findall(r"\$\((lerobot-[^)]+)\)", shown)
    inline = re.findall(r"`(lerobot-excav \w+ [^`]*--[^`]+)`", text)
    lines = [re.sub(r"\$\([^)]*\)", "", shown), *inside, *inline]
    starts = [match.start() for line in lines[:1] for match in re.finditer(r"^lerobot-", line, flags=re.MULTILINE)]
    whole = [lines[0][a:b] for a, b in pairwise([*starts, len(lines[0])])]
    for command in [*(_one(text) for text in whole), *lines[1:]]:
        words = [INVENTED.get(word, word) for word in shlex.split(command, comments=True)]
        yield [word for word in words if word is not None]


def _one(text):
    """Cut what follows a command: it ends with its line, unless a quotation goes on."""
    for end in [match.start() for match in re.finditer(r"\n|\Z", text)]:
        if text[:end].count("'") % 2 == 0:
            return text[:end]
    return text


@pytest.mark.parametrize("name", TEXTS)
def test_links_lead_somewhere(name):
    for target in re.findall(r"\]\(([^)\s]+)\)", TEXTS[name]):
        path, _, anchor = target.partition("#")
        if path.startswith("https://"):
            continue
        page = (ROOT / name).parent / path if path else ROOT / name
        assert page.exists(), target
        headings = re.findall(r"^#+ (.+)$", page.read_text(), flags=re.MULTILINE) if anchor else []
        slugs = [re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", h.lower())).strip("-") for h in headings]
        assert not anchor or anchor in slugs, target


@pytest.fixture(scope="module")
def files():
    folders = [path for path in ROOT.iterdir() if path.is_dir() and path.name[0] != "."]
    found = [path for folder in folders if folder.name not in ("outputs", "build", "dist") for path in folder.rglob("*")]
    return ["/" + str(path.relative_to(ROOT)) for path in [*found, *ROOT.iterdir()]]


@pytest.mark.parametrize("name", TEXTS)
def test_named_files_and_modules_exist(name, files):
    for shown in re.findall(r"`([^`\s]+)`", TEXTS[name]):
        for part in expanded(shown.rstrip("/")):
            is_file = re.fullmatch(r"[\w./-]+\.(py|toml|cff)|(lerobot_excav|tests|examples|workflows)/[\w./]+", part)
            if is_file and Path(part).name not in INVENTED_FILES:
                assert any(file.endswith("/" + part) for file in files), shown
    for module in re.findall(r"python -m ((?:validation|bench|tests)[\w.]*)", TEXTS[name]):
        path = "/" + module.replace(".", "/")
        assert f"{path}.py" in files or f"{path}/__main__.py" in files, module
    for module in re.findall(r"(?:^::: |`)(lerobot_excav[\w.]*\.\w+)`?$", TEXTS[name], flags=re.MULTILINE):
        resolve_name(module)


def expanded(name):
    """Spell `a_{b,c}.py` out."""
    match = re.fullmatch(r"(.*)\{(.*)\}(.*)", name)
    return [f"{match[1]}{part}{match[3]}" for part in match[2].split(",")] if match else [name]


@pytest.mark.parametrize("name", TEXTS)
def test_commands_can_be_parsed(name):
    from lerobot_excav.scripts.arguments import parse_arguments
    from lerobot_excav.scripts.main import COMMANDS

    for program, *words in commands(TEXTS[name]):
        if program != "lerobot-excav":
            for word in words:
                assert_is_an_option(word, words)
        elif words != ["--version"]:
            verb, *options = words
            assert verb in COMMANDS
            kind = importlib.import_module(f"lerobot_excav.scripts.{verb}").ARGUMENTS
            parse_arguments(kind, options, command=verb, description="")


def assert_is_an_option(word, words):
    """Check an option of LeRobot's that belongs to something of this package."""
    import lerobot_excav.plugin  # noqa: F401
    from lerobot.configs import PreTrainedConfig
    from lerobot.envs.configs import EnvConfig
    from lerobot.robots import RobotConfig
    from lerobot.teleoperators import TeleoperatorConfig

    kinds = {"env": EnvConfig, "robot": RobotConfig, "teleop": TeleoperatorConfig, "policy": PreTrainedConfig}
    option = re.match(r"--(\w+)\.(\w+)=", word)
    chosen = option and next((w.split("=")[1] for w in words if w.startswith(f"--{option[1]}.type=")), None)
    if chosen and option[1] in kinds:
        known = {field.name for field in fields(kinds[option[1]].get_choice_class(chosen))}
        assert option[2] in known | {"type"}, word


@pytest.mark.parametrize("name", TEXTS)
def test_python_examples_run_or_compile(name):
    for code in blocks(TEXTS[name], "python"):
        if ">>>" in code:
            test = doctest.DocTestParser().get_doctest(code, {}, name, name, 0)
            assert doctest.DocTestRunner().run(test).failed == 0
        else:
            ast.parse(code)


@pytest.mark.parametrize("name", TEXTS)
def test_tables_are_those_of_the_code(name, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    assert importlib.import_module("tables").with_tables(TEXTS[name]) == TEXTS[name], "run python docs/tables.py"


def test_every_command_has_its_section():
    from lerobot_excav.scripts.main import COMMANDS

    sections = re.findall(r"^## (\S+)$", TEXTS["docs/reference/cli.md"], flags=re.MULTILINE)
    assert set(COMMANDS) <= set(sections)


def test_the_example_has_as_many_files_as_its_page_says():
    count = sum(path.is_file() and "__pycache__" not in path.parts for path in (ROOT / "examples/toy_reach").rglob("*"))
    assert f"**{count} new files" in TEXTS["docs/how-to/add-a-task.md"]
    assert f"{count} new files" in TEXTS["docs/how-to/index.md"]


@pytest.mark.parametrize("name", TEXTS)
def test_older_words_are_gone(name):
    assert [word for word in OLDER_WORDS if word in TEXTS[name]] == []
