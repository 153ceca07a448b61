"""What stands on a result page, as a TOML file says it."""

import json
import os
import re
import tomllib
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from lerobot_excav.datasets.format.validated import validated
from lerobot_excav.errors import ConfigurationError, require

CURVES = "curves"
"""Folder of the curves' metrics beside those of the rows, where a page keeps copies."""


def _plain_name(name: str) -> str:
    """Return a name that a file beside others may have: a page writes a copy of its metrics under it."""
    if not re.fullmatch(r"[^./\\\x00-\x1f][^/\\\x00-\x1f]*", name):
        raise ValueError(f"{name!r:.60} cannot name a file; leave out slashes and a dot in front")
    return name


def _folder(path: str) -> str:
    if not path or "\0" in path:
        raise ValueError(f"{path!r:.60} is not a folder")
    return path


def _named_folder(path: str) -> str:
    """Return a folder by whose name a page keeps the metrics in it."""
    _plain_name(Path(path).name)
    return path


Text = Annotated[str, Field(min_length=1)]
Name = Annotated[str, AfterValidator(_plain_name)]
Folder = Annotated[str, AfterValidator(_folder)]
NamedFolder = Annotated[Folder, AfterValidator(_named_folder)]


class _Table(BaseModel):
    """A table of the file, whose keys are the fields of the class."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


class Row(_Table):
    """A row: one evaluation, or one for every training seed."""

    label: Name  # of its metrics
    about: Text  # the policy, in words
    seeds: tuple[Annotated[int, Field(ge=0)], ...] = ()  # of its trainings; their metrics are called LABEL-SEED
    paper: dict[str, float] = {}  # the paper's figures by key of their column, rates in percent
    setting: dict[str, Text] = {}  # by header what tells the row apart, where its metrics cannot know: a withheld mask

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its metrics."""
        return tuple(f"{self.label}-{seed}" for seed in self.seeds) or (self.label,)


class Section(_Table):
    """A table of rows."""

    title: Text
    rows: tuple[Row, ...] = ()
    text: str = ""  # what is to be known before
    reference: str | None = None  # label of the row, here or elsewhere, that the others are compared with
    operator: str | None = None  # label of the row, here or elsewhere, that efficiencies are related to


class CurveSource(_Table):
    """Evaluations of the checkpoints of one training."""

    label: Text  # in the plot
    folder: NamedFolder  # holds an evaluation per checkpoint, named by its step


class Clips(_Table):
    """Episodes of one evaluation, side by side in the video grid."""

    label: Name  # of its metrics
    episodes: tuple[Annotated[int, Field(ge=0, le=2**31 - 1)], ...]


class Contents(_Table):
    """Everything on the page."""

    title: Text
    metrics: Folder  # of the metrics files
    videos: Folder | None = None  # of the videos, NAME/videos for an evaluation; left out: beside its metrics
    section: tuple[Section, ...] = ()
    text: str = ""  # what is to be known before
    curve: tuple[CurveSource, ...] = ()  # success against training
    clips: tuple[Clips, ...] = ()  # rows of the video grid

    @property
    def rows(self) -> list[Row]:
        """All rows, section by section."""
        return [row for section in self.section for row in section.rows]

    def metrics_paths(self, row: Row) -> dict[str, Path]:
        """Return where the metrics of a row lie that are there, by their names: in a folder of that name, or a file."""
        return {name: path for name in row.names if (path := self._metrics_path(name)).exists()}

    def _metrics_path(self, name: str) -> Path:
        folder = Path(self.metrics) / name / "metrics.jsonl"
        return folder if folder.exists() else Path(self.metrics) / f"{name}.jsonl"

    @model_validator(mode="after")
    def _names_fit(self) -> "Contents":
        labels, names = [row.label for row in self.rows], [name for row in self.rows for name in row.names]
        # A page keeps the metrics of a curve by the name of its folder.
        folders = [Path(curve.folder).name for curve in self.curve]
        if twice := sorted({name for one in (labels, names) for name in one if one.count(name) > 1}):
            raise ValueError(f"{twice} stands on the page twice")
        if twice := sorted({name for name in folders if folders.count(name) > 1}):
            raise ValueError(f"{twice} are the folders of two curves; name each folder once")
        named = [("reference", section.reference) for section in self.section if section.reference is not None]
        named += [("operator", section.operator) for section in self.section if section.operator is not None]
        named += [("clips of", clips.label) for clips in self.clips]
        for kind, label in named:
            if label not in labels:
                raise ValueError(f"{kind} {label!r:.60} is not a row; allowed: {', '.join(labels)}")
        return self


def read_contents(path: Path, *, metrics: Path | None = None, videos: Path | None = None) -> Contents:
    """Read what stands on a page from a TOML file.

    `metrics` is a folder of metrics files in place of the file's: one that a page has kept, with the curves in it, or
    that of another run of the experiment, with the curves where they lie seen from the file's folder. `videos` is a
    folder of videos in place of the file's.

    Raises:
        ConfigurationError: The file is missing or damaged, a key is unknown or missing, a value is of another type, a
            row or a curve occurs twice, or a reference is not a row.
    """
    require(path.is_file(), f"--rows={path} does not exist")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    # Damaged, not text, or a number of thousands of digits.
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(f"--rows={path} is not TOML: {error}") from error
    # Dates have no JSON form; as text they are refused where a number is asked for.
    text = json.dumps(content, default=str)
    contents = validated(Contents, text, f"--rows={path}", error=ConfigurationError)
    if videos is not None:
        contents = contents.model_copy(update={"videos": str(videos)})
    return contents if metrics is None else _moved(contents, metrics)


def _moved(contents: Contents, metrics: Path) -> Contents:
    """Return the contents with the metrics of rows and curves elsewhere."""
    curves = []
    for curve in contents.curve:
        kept = metrics / CURVES / Path(curve.folder).name
        seen_from_there = os.path.normpath(metrics / os.path.relpath(curve.folder, contents.metrics))
        curves.append(curve.model_copy(update={"folder": str(kept) if kept.exists() else seen_from_there}))
    return contents.model_copy(update={"metrics": str(metrics), "curve": tuple(curves)})
