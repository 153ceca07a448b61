"""A result page in numbers: rows with where they come from, differences and curves."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.measures import TaskMeasures
from lerobot_excav.errors import require
from lerobot_excav.evaluation.comparison import Difference, compare, require_same_task
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.report import file_notes
from lerobot_excav.evaluation.result_page.contents import Contents, Row, Section
from lerobot_excav.evaluation.result_page.curves import SuccessCurve, read_curve
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.run_summary import RunSummary, measured
from lerobot_excav.evaluation.training import TrainingFacts


@dataclass(frozen=True, kw_only=True)
class PageRow(RunSummary):
    """A row: what the contents say of it, its numbers, and its command, code and training."""

    row: Row
    origin: EvaluationOrigin

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain data."""
        known = {"about": self.row.about, "paper": self.row.paper, "seed": self.run.first.seed}
        return {**super().as_dict(), **known, "origin": self.origin.model_dump()}


@dataclass(frozen=True, kw_only=True)
class PageDifference:
    """A row minus its reference, by measure, on the scenes that both have played, with their number."""

    label: str
    reference: str
    scenes: int
    differences: list[Difference]


@dataclass(frozen=True, kw_only=True)
class PageSection:
    """A table: the rows that have been run, the labels of those that have not, differences to the reference."""

    section: Section
    rows: list[PageRow]
    missing: list[str]
    differences: list[PageDifference]

    def as_dict(self) -> dict[str, Any]:
        """Return the section as plain data."""
        return {
            "title": self.section.title,
            "rows": [row.as_dict() for row in self.rows],
            "missing": self.missing,
            "differences": [asdict(difference) for difference in self.differences],
        }


@dataclass(frozen=True, kw_only=True)
class ResultPage:
    """Everything that a result page says, and the seed of all resampling."""

    contents: Contents
    sections: list[PageSection]
    curves: list[SuccessCurve]
    bootstrap_seed: int

    @property
    def rows(self) -> list[PageRow]:
        """All rows that have been run."""
        return [row for section in self.sections for row in section.rows]

    @property
    def trainings(self) -> list[TrainingFacts]:
        """The checkpoints that were evaluated, each once."""
        trainings = [row.origin.training for row in self.rows if row.origin.training is not None]
        return list({(training.name, training.steps): training for training in trainings}.values())

    @property
    def notes(self) -> list[str]:
        """What a reader has to know about the files."""
        runs = [row.run for row in self.rows]
        runs += [point.run for curve in self.curves for point in curve.points]
        return [note for run in runs for note in file_notes(run)]

    def as_dict(self) -> dict[str, Any]:
        """Return the page as plain data."""
        return {
            "title": self.contents.title,
            "sections": [section.as_dict() for section in self.sections],
            "curves": [curve.as_dict() for curve in self.curves],
            "bootstrap_seed": self.bootstrap_seed,
            "notes": self.notes,
        }


def make_page(contents: Contents, *, seed: int = 0) -> ResultPage:
    """Read the evaluations of a page and sum them up, bootstrapped from a seed; what was not run is left out and named.

    Raises:
        ConfigurationError: A figure of the paper has no column, or an evaluation mixes conditions.
        DatasetError: A metrics file cannot be used, rows of a section are of different tasks or cannot be compared, or
            so are the points of a curve.
    """
    rng = np.random.default_rng(seed)
    rows = {row.label: _row(contents, row, rng) for row in contents.rows if contents.metrics_path(row.label).exists()}
    return ResultPage(
        contents=contents,
        sections=[_section(section, rows, rng) for section in contents.section],
        curves=[curve for curve in map(read_curve, contents.curve) if curve.points],
        bootstrap_seed=seed,
    )


def _row(contents: Contents, row: Row, rng: np.random.Generator) -> PageRow:
    path = contents.metrics_path(row.label)
    run = Run(label=row.label, evaluations=(read_evaluation(path),))
    return PageRow(row=row, run=run, values=measured(run, None, rng), origin=EvaluationOrigin.read(path))


def _section(section: Section, rows: dict[str, PageRow], rng: np.random.Generator) -> PageSection:
    present = [rows[row.label] for row in section.rows if row.label in rows]
    reference = rows.get(section.reference or "")
    for row in present:
        require_same_task((reference or present[0]).run, row.run)
    if present:
        _require_known_figures(section, present[0].run.measures)
    return PageSection(
        section=section,
        rows=present,
        missing=[row.label for row in section.rows if row.label not in rows],
        differences=[_difference(reference.run, row.run, rng) for row in present if reference and row is not reference],
    )


def _require_known_figures(section: Section, measures: TaskMeasures) -> None:
    """Raise `ConfigurationError` unless every figure of the paper stands beside a column, also in rows not yet run."""
    for row in section.rows:
        for key in row.paper:
            allowed = ", ".join(measures.compared)
            require(key in measures.compared, f"row {row.label!r}: paper.{key} has no column; allowed: {allowed}")


def _difference(reference: Run, run: Run, rng: np.random.Generator) -> PageDifference:
    """Compare on common scenes: a row may have played fewer of them than its reference."""
    common = set(reference.keys) & set(run.keys)
    differences = compare(reference.only(common), run.only(common), rng) if common else []
    return PageDifference(label=run.label, reference=reference.label, scenes=len(common), differences=differences)
