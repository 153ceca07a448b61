"""What the pages say is so: links, files, modules, commands, options, tables, examples."""

import ast
import doctest
import importlib
import re
import shlex
import textwrap
from dataclasses import fields
from pathlib import Path
from pkgutil import resolve_name

import lerobot.robots.so_follower  # noqa: F401 - pages name one of its arms
import pytest
from lerobot.configs import PreTrainedConfig
from lerobot.envs.configs import EnvConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401
from lerobot_excav.scripts.arguments import parse_arguments
from lerobot_excav.scripts.main import COMMANDS, module_of

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
TEXTS = {str(page.relative_to(ROOT)): page.read_text() for page in PAGES}

KINDS = {"env": EnvConfig, "robot": RobotConfig, "teleop": TeleoperatorConfig, "policy": PreTrainedConfig}

# What a reader adds by following a page, and what stands for it here. None: left out.
INVENTED = {
    "--env.type=toy_reach": "--env.type=excavator",
    "--env.table=ice": None,
    "--env.soil=clay": "--env.soil=sand",
    "--env.mask_source=redness": "--env.mask_source=oracle",
    "--policy.mask_strength=2": None,
}
INVENTED_FILES = {
    "main.toml",
    "lerobot_env_redness.py",
    "sam.toml",
    "vlm.toml",
    "drawn.toml",
    "live.toml",
    "clicks.toml",
    "config_toy_reach_sim.py",
    "toy_reach_sim.py",
}

OLDER_WORDS = re.compile(
    r"--env=|bench (soil|operator|fuzz)|lerobot-excav experiment|stages\.toml|version 1\b| anew|it is not so"
    r"|--(target-rule|keep-failures|eval-fraction|skip-restarted|include-failures|scene-set|first-scene)"
)


def blocks(text, language):
    found = re.findall(rf"^ *```{language}\n(.*?)^ *```$", text, flags=re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(code) for code in found]


def commands(text):
    """The commands of LeRobot and of this package in a page, as words; those within `$(...)` apart."""
    shown = "\n".join(blocks(text, "bash")).replace("\\\n", " ")
    inside = re.findall(r"\$\((lerobot-[^)]+)\)", shown)
    inline = re.findall(r"`(lerobot-excav [a-z]+ [^`]*--[^`]+)`", text)
    # A line, or more where a quotation runs over them.
    whole = re.findall(r"^lerobot-(?:[^'\n]|'[^']*')*", re.sub(r"\$\([^)]*\)", "", shown), flags=re.MULTILINE)
    for command in [*whole, *inside, *inline]:
        words = [INVENTED.get(word, word) for word in shlex.split(command, comments=True)]
        yield [word for word in words if word is not None]


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
    shown = [
        path for path in ROOT.iterdir() if path.name[0] != "." and path.name not in ("outputs", "build", "dist", "site")
    ]
    return ["/" + str(path.relative_to(ROOT)) for top in shown for path in [top, *top.rglob("*")]]


@pytest.mark.parametrize("name", TEXTS)
def test_named_files_and_modules_exist(name, files):
    for shown in re.findall(r"[^`\s\"'(),;]+", TEXTS[name]):
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
    for program, *words in commands(TEXTS[name]):
        if program != "lerobot-excav":
            for word in words:
                assert_is_an_option(word, words)
        elif words != ["--version"]:
            verb, *options = words
            assert verb in COMMANDS
            kind = module_of(verb).ARGUMENTS
            parse_arguments(kind, options, command=verb, description="")


def assert_is_an_option(word, words):
    """Check an option of LeRobot's that belongs to something of this package."""
    option = re.match(r"--(\w+)\.(\w+)=", word)
    chosen = option and next((w.split("=")[1] for w in words if w.startswith(f"--{option[1]}.type=")), None)
    if chosen and option[1] in KINDS:
        known = {field.name for field in fields(KINDS[option[1]].get_choice_class(chosen))}
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
    sections = re.findall(r"^## (\S+)$", TEXTS["docs/reference/cli.md"], flags=re.MULTILINE)
    assert set(COMMANDS) <= set(sections)


def test_the_example_has_as_many_files_as_its_page_says():
    count = sum(path.is_file() and "__pycache__" not in path.parts for path in (ROOT / "examples/toy_reach").rglob("*"))
    assert f"**{count} new files" in TEXTS["docs/how-to/add-a-task.md"]
    assert f"{count} new files" in TEXTS["docs/how-to/index.md"]


@pytest.mark.parametrize("name", TEXTS)
def test_older_words_are_gone(name):
    assert OLDER_WORDS.search(TEXTS[name]) is None
