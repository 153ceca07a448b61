"""A result page in numbers: rows with where they come from, differences and curves."""

from dataclasses import asdict, dataclass
from pathlib import Path
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
from lerobot_excav.evaluation.run_summary import RunSummary, summarise
from lerobot_excav.evaluation.training import TrainingFacts


@dataclass(frozen=True, kw_only=True)
class PageRow:
    """A row in numbers.

    Attributes:
        row: What the page says of it.
        summary: The episodes and their measures.
        origin: Command, code and training.
    """

    row: Row
    summary: RunSummary
    origin: EvaluationOrigin

    @property
    def run(self) -> Run:
        """The episodes."""
        return self.summary.run

    @property
    def metrics(self) -> Path:
        """The metrics file."""
        return self.run.evaluations[0].path

    @property
    def seed(self) -> int | None:
        """Seed of the evaluation."""
        return self.run.evaluations[0].seed

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain data."""
        return {
            **self.summary.as_dict(),
            "about": self.row.about,
            "paper": self.row.paper,
            "seed": self.seed,
            "origin": self.origin.model_dump(),
        }


@dataclass(frozen=True, kw_only=True)
class PageDifference:
    """A row compared with a reference on the scenes that both have played.

    Attributes:
        label: The row.
        reference: What it is compared with.
        scenes: How many scenes and targets.
        differences: Row minus reference, by measure.
    """

    label: str
    reference: str
    scenes: int
    differences: list[Difference]


@dataclass(frozen=True, kw_only=True)
class PageSection:
    """A table in numbers.

    Attributes:
        section: What the page says of it.
        rows: The rows that have been run.
        missing: Labels of those that have not.
        differences: To the section's reference.
    """

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
    """Everything a result page says.

    Attributes:
        contents: What was asked for.
        sections: The tables.
        curves: Success against training.
        bootstrap_seed: Seed of all resampling.
    """

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
        found = {
            (training.name, training.steps): training
            for row in self.rows
            if (training := row.origin.training) is not None
        }
        return list(found.values())

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
    """Read the evaluations of a page and sum them up; what has not been run is left out and named.

    Args:
        contents: What stands on the page.
        seed: Seed of the bootstrap.

    Raises:
        ConfigurationError: A figure of the paper has no column, or an evaluation mixes conditions.
        DatasetError: A metrics file cannot be used, rows of a section are of different tasks or cannot be compared, or
            so are the points of a curve.
    """
    rng = np.random.default_rng(seed)
    rows = {row.label: _row(contents, row, rng) for row in contents.rows if _is_run(contents, row)}
    return ResultPage(
        contents=contents,
        sections=[_section(section, rows, rng) for section in contents.section],
        curves=[curve for curve in map(read_curve, contents.curve) if curve.points],
        bootstrap_seed=seed,
    )


def _is_run(contents: Contents, row: Row) -> bool:
    return contents.metrics_path(row.label).exists()


def _row(contents: Contents, row: Row, rng: np.random.Generator) -> PageRow:
    path = contents.metrics_path(row.label)
    run = Run(label=row.label, evaluations=(read_evaluation(path),))
    return PageRow(row=row, summary=summarise(run, None, rng), origin=EvaluationOrigin.read(path))


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
            require(
                key in measures.compared,
                f"row {row.label!r}: paper.{key} has no column; allowed: {', '.join(measures.compared)}",
            )


def _difference(reference: Run, run: Run, rng: np.random.Generator) -> PageDifference:
    """Compare on common scenes: a row may have played fewer of them than its reference."""
    common = set(reference.keys) & set(run.keys)
    differences = compare(reference.only(common), run.only(common), rng) if common else []
    return PageDifference(label=run.label, reference=reference.label, scenes=len(common), differences=differences)
