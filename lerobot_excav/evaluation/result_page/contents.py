"""What stands on a result page, as a TOML file says it."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

from lerobot_excav.errors import ConfigurationError, require

CURVES = "curves"
"""Folder of the curves' metrics beside those of the rows, where a page keeps copies."""


@dataclass(frozen=True, kw_only=True)
class _Table:
    """A table of the file, whose keys are the fields of the class."""

    @classmethod
    def read(cls, table: Mapping[str, Any], place: str, **others: Any) -> Self:
        """Make an object of a table.

        Args:
            table: The table.
            place: The file, for messages.
            others: Fields that do not stand in the table as they are.

        Raises:
            ConfigurationError: A key is unknown or missing.
        """
        names = {field.name for field in fields(cls)}
        unknown = sorted(set(table) - names)
        require(not unknown, f"{place}: {unknown} is not known in {cls.__name__}; allowed: {sorted(names)}")
        try:
            return cls(**{**table, **others})
        except TypeError as error:
            raise ConfigurationError(f"{place}: a {cls.__name__} is incomplete: {error}") from None


@dataclass(frozen=True, kw_only=True)
class Row(_Table):
    """A row: one evaluation.

    Attributes:
        label: Name of its metrics.
        about: The policy, in words.
        paper: Figures of the paper by key of their column, rates in percent.
    """

    label: str
    about: str
    paper: Mapping[str, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Section(_Table):
    """A table of rows.

    Attributes:
        title: Heading.
        rows: The rows.
        text: What is to be known before.
        reference: Label of the row that the others are compared with, scene by scene; it may stand elsewhere.
    """

    title: str
    rows: tuple[Row, ...]
    text: str = ""
    reference: str | None = None


@dataclass(frozen=True, kw_only=True)
class CurveSource(_Table):
    """Evaluations of the checkpoints of one training.

    Attributes:
        label: Name in the plot.
        folder: Folder with an evaluation per checkpoint, named by its step.
    """

    label: str
    folder: str


@dataclass(frozen=True, kw_only=True)
class Clips(_Table):
    """Clips of one evaluation, side by side in the video grid.

    Attributes:
        label: Name of the metrics.
        episodes: Which episodes.
    """

    label: str
    episodes: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Contents(_Table):
    """Everything on the page.

    Attributes:
        title: Heading.
        metrics: Folder of the metrics files.
        section: Tables.
        text: What is to be known before.
        curve: Success against training.
        clips: Rows of the video grid.
    """

    title: str
    metrics: str
    section: tuple[Section, ...]
    text: str = ""
    curve: tuple[CurveSource, ...] = ()
    clips: tuple[Clips, ...] = ()

    @property
    def rows(self) -> list[Row]:
        """All rows, section by section."""
        return [row for section in self.section for row in section.rows]

    def metrics_path(self, label: str) -> Path:
        """Return where the metrics of a row lie: in a folder of its name, or a file."""
        folder = Path(self.metrics) / label / "metrics.jsonl"
        return folder if folder.exists() else Path(self.metrics) / f"{label}.jsonl"


def read_contents(path: Path, *, metrics: Path | None = None) -> Contents:
    """Read what stands on a page.

    Args:
        path: The TOML file.
        metrics: Folder of the metrics files in place of the file's: one that a page has kept, with the curves in it,
            or that of another run of the experiment, with the curves where they lie seen from the file's folder.

    Raises:
        ConfigurationError: The file is missing or damaged, a key is unknown or missing, a row or a
            curve occurs twice, or a reference is no row.
    """
    try:
        content = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise ConfigurationError(f"--rows={path} does not exist") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"--rows={path} is no TOML: {error}") from error
    if metrics is not None:
        for table in content.get("curve", ()):
            table["folder"] = str(_moved(Path(table.get("folder", "")), content.get("metrics", ""), metrics))
        content["metrics"] = str(metrics)
    place = str(path)
    contents = Contents.read(
        content,
        place,
        section=tuple(_section(table, place) for table in content.get("section", ())),
        curve=tuple(CurveSource.read(table, place) for table in content.get("curve", ())),
        clips=tuple(
            Clips.read(table, place, episodes=tuple(table.get("episodes", ())))
            for table in content.get("clips", ())
        ),
    )
    _check(contents, place)
    return contents


def _moved(folder: Path, metrics: str, moved_metrics: Path) -> Path:
    """Return where the metrics of a curve lie when those of the rows lie elsewhere."""
    kept = moved_metrics / CURVES / folder.name
    return (
        kept
        if kept.exists()
        else Path(os.path.normpath(moved_metrics / os.path.relpath(folder, metrics or ".")))
    )


def _section(table: Mapping[str, Any], place: str) -> Section:
    return Section.read(table, place, rows=tuple(Row.read(row, place) for row in table.get("rows", ())))


def _check(contents: Contents, place: str) -> None:
    labels = [row.label for row in contents.rows]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    require(not twice, f"{place}: {twice} stands on the page twice")
    # A page keeps the metrics of a curve by the name of its folder.
    folders = [Path(curve.folder).name for curve in contents.curve]
    twice = sorted({name for name in folders if folders.count(name) > 1})
    require(not twice, f"{place}: {twice} are the folders of two curves; name each folder once")
    named = [section.reference for section in contents.section if section.reference is not None]
    for label in [*named, *(clips.label for clips in contents.clips)]:
        require(label in labels, f"{place}: {label!r} is no row; allowed: {', '.join(labels)}")
