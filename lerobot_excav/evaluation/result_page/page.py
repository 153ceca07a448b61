"""A result page in numbers: rows with where they come from, differences and curves."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.measures import TaskMeasures
from lerobot_excav.errors import require
from lerobot_excav.evaluation.comparison import Difference, compare, require_same_task
from lerobot_excav.evaluation.crossed_effects import holm
from lerobot_excav.evaluation.metrics import Evaluation, read_evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.report import file_notes
from lerobot_excav.evaluation.result_page.contents import Contents, Row, Section
from lerobot_excav.evaluation.result_page.curves import SuccessCurve, read_curve
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.run_summary import RunSummary, measured
from lerobot_excav.evaluation.training import TrainingFacts


@dataclass(frozen=True, kw_only=True)
class PageRow(RunSummary):
    """A row: what the contents say of it, its numbers, and command, code and training of each of its evaluations.

    The evaluations are named as their metrics are.
    """

    row: Row
    origins: dict[str, EvaluationOrigin]

    @property
    def setting(self) -> dict[str, str]:
        """What tells the row apart, by header."""
        return self.run.setting | self.row.setting

    @property
    def seeds(self) -> str:
        """Number of its training seeds, in words; an operator has none."""
        return "-" if self.run.first.operator else str(len(self.run.evaluations))

    @property
    def parts(self) -> list[tuple[str, Evaluation, EvaluationOrigin]]:
        """The evaluations, each with its name and where it comes from."""
        pairs = zip(self.origins.items(), self.run.evaluations, strict=True)
        return [(name, evaluation, origin) for (name, origin), evaluation in pairs]

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain data."""
        known = {"about": self.row.about, "paper": self.row.paper, "seed": self.run.first.seed}
        origins = {name: origin.model_dump() for name, origin in self.origins.items()}
        return {**super().as_dict(), **known, "origins": origins}


@dataclass(frozen=True, kw_only=True)
class PageDifference:
    """A row minus its reference, by measure, on the scenes that both have played, with their number."""

    label: str  # of the row
    reference: str
    scenes: int
    seeds: str  # of the row and of the reference
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
        origins = [origin for row in self.rows for origin in row.origins.values()]
        trainings = [origin.training for origin in origins if origin.training is not None]
        return list({(training.name, training.steps): training for training in trainings}.values())

    @property
    def is_corrected(self) -> bool:
        """Whether p-values are corrected for their number anywhere."""
        compared = [row for section in self.sections for row in section.differences]
        return any(change.p_corrected is not None for row in compared for change in row.differences)

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
    runs = {row.label: _run(contents, row) for row in contents.rows if contents.metrics_paths(row)}
    operators = {row.label: section.operator for section in contents.section for row in section.rows}
    rows = {
        row.label: _row(contents, row, runs[row.label], runs.get(operators[row.label] or ""), rng)
        for row in contents.rows
        if row.label in runs
    }
    return ResultPage(
        contents=contents,
        sections=[_section(section, rows) for section in contents.section],
        curves=[curve for curve in map(read_curve, contents.curve) if curve.points],
        bootstrap_seed=seed,
    )


def _run(contents: Contents, row: Row) -> Run:
    paths = contents.metrics_paths(row).values()
    return Run(label=row.label, evaluations=tuple(read_evaluation(path) for path in paths))


def _row(contents: Contents, row: Row, run: Run, operator: Run | None, rng: np.random.Generator) -> PageRow:
    origins = {name: EvaluationOrigin.read(path) for name, path in contents.metrics_paths(row).items()}
    return PageRow(row=row, run=run, values=measured(run, operator, rng), origins=origins)


def _section(section: Section, rows: dict[str, PageRow]) -> PageSection:
    present = [rows[row.label] for row in section.rows if row.label in rows]
    reference = rows.get(section.reference or "")
    for row in present:
        require_same_task((reference or present[0]).run, row.run)
    if present:
        _require_known_figures(section, present[0].run.measures)
    others = [row for row in present if reference and row is not reference]
    return PageSection(
        section=section,
        rows=present,
        missing=[name for row in section.rows for name in row.names if not _has(rows, row, name)],
        differences=_corrected(
            [_difference(reference, row) for row in others if reference],
            planned={row.label for row in section.rows} - {section.reference, section.operator},
        ),
    )


def _has(rows: dict[str, PageRow], row: Row, name: str) -> bool:
    return row.label in rows and name in rows[row.label].origins


def _require_known_figures(section: Section, measures: TaskMeasures) -> None:
    """Raise `ConfigurationError` unless all that rows say by name stands in a column, also in rows not yet run."""
    for row in section.rows:
        named = [("setting", header, list(measures.setting)) for header in row.setting]
        named += [("paper", key, list(measures.compared)) for key in row.paper]
        for table, name, allowed in named:
            words = f"row {row.label!r}: {table}.{name} has no column; allowed: {', '.join(allowed)}"
            require(name in allowed, words)


def _difference(reference: PageRow, row: PageRow) -> PageDifference:
    """Compare on common scenes: a row may have played fewer of them than its reference."""
    common = set(reference.run.keys) & set(row.run.keys)
    return PageDifference(
        label=row.row.label,
        reference=reference.row.label,
        scenes=len(common),
        seeds=f"{row.seeds} vs {reference.seeds}",
        differences=compare(reference.run.only(common), row.run.only(common)) if common else [],
    )


def _corrected(rows: list[PageDifference], *, planned: set[str]) -> list[PageDifference]:
    """Correct p-values for the number of rows that are compared with one reference, measure by measure.

    Those are all that are planned, whether they have been run or not, so that a p-value of today is not corrected
    otherwise tomorrow. An operator is what all are related to, and none of them.
    """
    compared = [row for row in rows if row.differences and row.label in planned]
    if len(planned) < 2 or not compared:
        return rows
    by_measure = zip(*(row.differences for row in compared), strict=True)
    columns = [_with_corrected(column, family=len(planned)) for column in by_measure]
    corrected = {
        row.label: list(differences) for row, differences in zip(compared, zip(*columns, strict=True), strict=True)
    }
    return [replace(row, differences=corrected.get(row.label, row.differences)) for row in rows]


def _with_corrected(column: tuple[Difference, ...], *, family: int) -> list[Difference]:
    known = [difference.p_value for difference in column if difference.p_value is not None]
    corrected = iter(holm(known, family=family))
    return [change if change.p_value is None else replace(change, p_corrected=next(corrected)) for change in column]
