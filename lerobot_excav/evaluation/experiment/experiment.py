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

A command is run by bash, as one line; `${NAME}` is left to it. Paths are relative to the folder in which the experiment
is run. A stage may need all earlier ones that match a pattern (`train-*`). `{makes}` is `….partial` while the command
runs, unless `appears_whole = true`.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from lerobot_excav.errors import ConfigurationError, require, require_choice
from lerobot_excav.evaluation.experiment.stage import Resumption, Stage, workspace_of
from lerobot_excav.evaluation.experiment.words import Words, fill, fill_command, fill_path

_TABLES = {"settings": dict, "environment": dict, "stage": list}
_STAGE_KEYS = {
    "name": str,
    "each": list,
    "needs": list,
    "makes": str,
    "command": str,
    "appears_whole": bool,
    "resume_from": str,
    "resume": str,
}
_TYPES = {
    str: "text; put it in quotes",
    bool: "truth value; write true or false, without quotes",
    list: "list; put it in brackets",
    dict: "table; give NAME = VALUE pairs",
}


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
        ConfigurationError: The file is missing or damaged, has an entry that cannot be used, or has a stage twice.
    """
    content = _content(path)
    words = _texts(content.get("settings", {}))
    for name in settings or {}:
        require_choice("--set", name, list(words))
    words |= settings or {}
    stages = [stage for table in content.get("stage", []) for stage in _stages(table, words, path)]
    stages = _with_needs(stages, path)
    return Experiment(path=path, stages=tuple(stages), environment=_texts(content.get("environment", {})))


def _content(path: Path) -> dict[str, Any]:
    try:
        content = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise ConfigurationError(f"{path} does not exist; name the TOML file of an experiment") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{path} is no TOML: {error}") from error
    for name, value in content.items():
        require_choice(f"{path}: table", name, list(_TABLES))
        _require_type(f"{path}: {name}", value, _TABLES[name])
    for table in content.get("stage", []):
        _require_type(f"{path}: stage", table, dict)
    return content


def _require_type(place: str, value: Any, kind: type) -> None:
    require(isinstance(value, kind), f"{place}={value!r} is no {_TYPES[kind]}")


def _stages(table: dict[str, Any], settings: Words, path: Path) -> list[Stage]:
    for key, value in table.items():
        require_choice(f"{path}: key of a stage", key, list(_STAGE_KEYS))
        _require_type(f"{path}: a stage's {key}", value, _STAGE_KEYS[key])
    for key in ("name", "command"):
        require(key in table, f"{path}: a stage lacks {key!r}: {table}")
    for row in table.get("each", []):
        _require_type(f"{path}: entry of a stage's each", row, dict)
    for need in table.get("needs", []):
        _require_type(f"{path}: entry of a stage's needs", need, str)
    require(
        table.get("each") != [],
        f"{path}: each=[] makes no stage {table['name']!r}; give a table per stage, or leave `each` out",
    )
    return [_stage(table, {**settings, **_texts(row)}, path) for row in table.get("each", [{}])]


def _texts(row: Mapping[str, Any]) -> dict[str, str]:
    return {name: str(value) for name, value in row.items()}


def _stage(table: dict[str, Any], words: Words, path: Path) -> Stage:
    place = f"{path}: {fill(table['name'], words, str(path))}"
    makes = fill_path(table["makes"], words, place) if "makes" in table else None
    appears_whole = table.get("appears_whole", False)
    workspace = workspace_of(makes, appears_whole=appears_whole)
    words = words if workspace is None else {**words, "makes": str(workspace)}
    return Stage(
        name=fill(table["name"], words, place),
        command=fill_command(table["command"], words, place),
        makes=makes,
        needs=tuple(fill(need, words, place) for need in table.get("needs", ())),
        appears_whole=appears_whole,
        resumption=_resumption(table, words, place),
    )


def _resumption(table: dict[str, Any], words: Words, place: str) -> Resumption | None:
    require(("resume" in table) == ("resume_from" in table), f"{place}: resume and resume_from go together")
    if "resume" not in table:
        return None
    source = fill_path(table["resume_from"], words, place)
    words = {**words, "resume_from": str(source)}
    return Resumption(command=fill_command(table["resume"], words, place), source=source)


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
