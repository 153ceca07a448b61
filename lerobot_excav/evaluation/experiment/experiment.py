"""An experiment as data: stages in a TOML file.

    [settings]                       # words that stand in braces elsewhere, in other settings too
    out = "outputs/digging"
    steps = 6000

    [environment]                    # variables of every command
    MUJOCO_GL = "egl"

    [[stage]]
    name = "train-{data}"
    each = [{ data = "paired" }, { data = "non_paired" }]      # optional: one stage per table of further words
    needs = ["data-{data}"]
    makes = "{out}/train/{data}"
    command = "lerobot-train --steps={steps} --output_dir={makes} …"
    resume_from = "{makes}/checkpoints/last/pretrained_model/train_config.json"
    resume = "lerobot-train --config_path={resume_from} --resume=true"

A command is run by bash, as one line. A stage may need all earlier ones that match a pattern (`train-*`). `{makes}` is
`….partial` while the command runs, unless `appears_whole = true`.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.evaluation.experiment.stage import Resumption, Stage, workspace_of

Words = Mapping[str, str]

_WORD = re.compile(r"\{(\w+)\}")
_STAGE_KEYS = ("name", "each", "needs", "makes", "command", "appears_whole", "resume_from", "resume")
_DEEPEST_NESTING = 10


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Stages in the order of their file, each after those it needs.

    Attributes:
        path: The file.
        stages: The stages.
        environment: Variables that every command gets.
    """

    path: Path
    stages: tuple[Stage, ...]
    environment: Words

    def stage(self, name: str) -> Stage:
        """Return a stage by its name."""
        return next(stage for stage in self.stages if stage.name == name)

    def select(self, patterns: Sequence[str]) -> list[Stage]:
        """Return the stages whose names match one of the patterns (`train-*`); all without a pattern.

        Raises:
            ConfigurationError: A pattern matches nothing.
        """
        for pattern in patterns:
            require(
                any(fnmatchcase(stage.name, pattern) for stage in self.stages),
                f"--only={pattern!r} matches no stage of {self.path}; `--list` shows them",
            )
        return [
            stage
            for stage in self.stages
            if not patterns or any(fnmatchcase(stage.name, pattern) for pattern in patterns)
        ]


def read_experiment(path: Path, settings: Words | None = None) -> Experiment:
    """Read an experiment.

    Args:
        path: The file.
        settings: Values in place of those of the file.

    Raises:
        ConfigurationError: The file is missing or damaged, names an unknown word or stage, or has a stage twice.
    """
    content = _content(path)
    words = {name: str(value) for name, value in content.get("settings", {}).items()}
    for name in settings or {}:
        require_choice("--set", name, list(words))
    words |= settings or {}
    stages = [stage for table in content.get("stage", []) for stage in _stages(table, words, path)]
    stages = _with_needs(stages, path)
    environment = {name: str(value) for name, value in content.get("environment", {}).items()}
    return Experiment(path=path, stages=tuple(stages), environment=environment)


def _content(path: Path) -> dict[str, Any]:
    try:
        content = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; name the TOML file of an experiment") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{path} is no TOML: {error}") from error
    for name in content:
        require_choice(f"{path}: table", name, ("settings", "environment", "stage"))
    return content


def _stages(table: dict[str, Any], settings: Words, path: Path) -> list[Stage]:
    for key in table:
        require_choice(f"{path}: key of a stage", key, _STAGE_KEYS)
    for key in ("name", "command"):
        require(key in table, f"{path}: a stage lacks {key!r}: {table}")
    for key in ("name", "makes", "command", "resume_from", "resume"):
        value = table.get(key, "")
        require(isinstance(value, str), f"{path}: {key}={value!r} of a stage is no text; put it in quotes")
    for key in ("each", "needs"):
        value = table.get(key, [])
        require(isinstance(value, list), f"{path}: {key}={value!r} of a stage is no list; put it in brackets")
    return [_stage(table, {**settings, **_texts(row)}, path) for row in table.get("each", [{}])]


def _texts(row: Mapping[str, Any]) -> dict[str, str]:
    return {name: str(value) for name, value in row.items()}


def _stage(table: dict[str, Any], words: Words, path: Path) -> Stage:
    place = f"{path}: {fill(table['name'], words, str(path))}"
    makes = Path(fill(table["makes"], words, place)) if "makes" in table else None
    appears_whole = bool(table.get("appears_whole", False))
    workspace = workspace_of(makes, appears_whole=appears_whole)
    words = words if workspace is None else {**words, "makes": str(workspace)}
    return Stage(
        name=fill(table["name"], words, place),
        command=_command(table["command"], words, place),
        makes=makes,
        needs=tuple(fill(need, words, place) for need in table.get("needs", ())),
        appears_whole=appears_whole,
        resumption=_resumption(table, words, place),
    )


def _resumption(table: dict[str, Any], words: Words, place: str) -> Resumption | None:
    require(("resume" in table) == ("resume_from" in table), f"{place}: resume and resume_from go together")
    if "resume" not in table:
        return None
    source = fill(table["resume_from"], words, place)
    return Resumption(
        command=_command(table["resume"], {**words, "resume_from": source}, place), source=Path(source)
    )


def _command(text: str, words: Words, place: str) -> str:
    return " ".join(fill(text, words, place).split())


def fill(text: str, words: Words, place: str) -> str:
    """Put words in the place of their names in braces; a word may hold further names.

    Args:
        text: Text with names in braces.
        words: Words by name.
        place: Where the text stands, for messages.

    Raises:
        ConfigurationError: A name is unknown, or words name each other without end.
    """

    def word(match: re.Match[str]) -> str:
        require(
            match[1] in words,
            f"{place}: {{{match[1]}}} is not known; allowed: {', '.join(sorted(words))}",
        )
        return words[match[1]]

    for _ in range(_DEEPEST_NESTING):
        if not _WORD.search(text):
            return text
        text = _WORD.sub(word, text)
    raise ConfigurationError(f"{place}: settings name each other without end: {text}")


def _with_needs(stages: Sequence[Stage], path: Path) -> list[Stage]:
    """Replace patterns by the names of earlier stages, so that none waits for itself; refuse names that occur twice."""
    known: list[str] = []
    complete = []
    for stage in stages:
        require(stage.name not in known, f"{path}: two stages are called {stage.name!r}")
        needs = []
        for pattern in stage.needs:
            found = [name for name in known if fnmatchcase(name, pattern)]
            require(bool(found), f"{path}: {stage.name} needs {pattern!r}, which is no earlier stage")
            needs += found
        known.append(stage.name)
        complete.append(replace(stage, needs=tuple(needs)))
    return complete
