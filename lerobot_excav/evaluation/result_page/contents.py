"""What stands on a result page, as a TOML file says it."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.evaluation.result_page.toml_table import TomlTable

CURVES = "curves"
"""Folder of the curves' metrics beside those of the rows, where a page keeps copies."""


@dataclass(frozen=True, kw_only=True)
class Row(TomlTable):
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
class Section(TomlTable):
    """A table of rows.

    Attributes:
        title: Heading.
        rows: The rows.
        text: What is to be known before.
        reference: Label of the row that the others are compared with, scene by scene; it may stand elsewhere.
    """

    title: str
    rows: tuple[Row, ...] = ()
    text: str = ""
    reference: str | None = None


@dataclass(frozen=True, kw_only=True)
class CurveSource(TomlTable):
    """Evaluations of the checkpoints of one training.

    Attributes:
        label: Name in the plot.
        folder: Folder with an evaluation per checkpoint, named by its step.
    """

    label: str
    folder: str


@dataclass(frozen=True, kw_only=True)
class Clips(TomlTable):
    """Clips of one evaluation, side by side in the video grid.

    Attributes:
        label: Name of the metrics.
        episodes: Which episodes.
    """

    label: str
    episodes: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Contents(TomlTable):
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
    section: tuple[Section, ...] = ()
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
        ConfigurationError: The file is missing or damaged, a key is unknown or missing, a value is of another type, a
            row or a curve occurs twice, or a reference is no row.
    """
    try:
        content = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise ConfigurationError(f"--rows={path} does not exist") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"--rows={path} is no TOML: {error}") from error
    contents = Contents.read(content, f"{path}: ")
    if metrics is not None:
        contents = _moved(contents, metrics)
    _check(contents, str(path))
    return contents


def _moved(contents: Contents, metrics: Path) -> Contents:
    """Return the contents with the metrics of rows and curves elsewhere."""
    curves = [
        replace(curve, folder=str(_moved_curve(Path(curve.folder), contents.metrics, metrics)))
        for curve in contents.curve
    ]
    return replace(contents, metrics=str(metrics), curve=tuple(curves))


def _moved_curve(folder: Path, metrics: str, moved_metrics: Path) -> Path:
    """Return where the metrics of a curve lie when those of the rows lie elsewhere."""
    kept = moved_metrics / CURVES / folder.name
    seen_from_there = Path(os.path.normpath(moved_metrics / os.path.relpath(folder, metrics)))
    return kept if kept.exists() else seen_from_there


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
