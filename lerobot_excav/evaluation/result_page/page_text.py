"""A result page in words: Markdown whose tables read well unrendered."""

from collections.abc import Collection, Iterator, Sequence

from lerobot_excav.envs.tasks.measures import Column, Kind
from lerobot_excav.evaluation.markdown import (
    difference_cells,
    interval_text,
    markdown_table,
    p_text,
    render,
    value_text,
)
from lerobot_excav.evaluation.metrics import Evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.report_text import simulations
from lerobot_excav.evaluation.result_page.kept_grid import VIDEO_GRID, ShownClips, is_of_earlier_metrics, shown_clips
from lerobot_excav.evaluation.result_page.method_figures import method_figures
from lerobot_excav.evaluation.result_page.page import PageRow, PageSection, ResultPage
from lerobot_excav.evaluation.training import TrainingFacts

CURVE_PLOT = "success.png"

_TRAINING = ("training", "data", "demonstrations", "steps", "batch", "samples", "minutes", "seed", "commit")
_POINT = ("policy", "played with", "step", "minutes", "n", "success [%]")


def page_text(page: ResultPage, *, files: Collection[str] = (), clips: Sequence[ShownClips] | None = None) -> str:
    """Write a page as Markdown.

    `files` are the plots and videos that lie beside it; `clips` what the video grid shows, from top to bottom, or None
    for all that the contents name and that was played.
    """
    return render(
        "page",
        page=page,
        sections=[
            (section, list(_tables(section)), [figure for figure in method_figures(section) if figure.name in files])
            for section in page.sections
        ],
        curve_sets=sorted({point.scene_set for curve in page.curves for point in curve.points}),
        curve_header=_POINT,
        curve_rows=_points(page),
        plot=CURVE_PLOT if CURVE_PLOT in files else "",
        video=VIDEO_GRID if VIDEO_GRID in files else "",
        clips=[
            (row, is_of_earlier_metrics(row, page))
            for row in (shown_clips(page, page.contents.clips) if clips is None else clips)
        ],
        training_header=_TRAINING,
        training_rows=[_training(training) for training in page.trainings],
        seed=page.bootstrap_seed,
        measures=_legend(page),
        simulations=simulations([row.run for row in page.rows]) if page.rows else "",
        versions=_versions(page),
        single=[row.row.about for row in page.rows if row.seeds == "1"],
        has_blue=_has_blue(page),
        commands=_commands(page),
        by_hand=_by_hand(page),
    )


def _has_blue(page: ResultPage) -> bool:
    """Tell whether a rollout may have a blue border: its record says whether the machine did what a wrong mask said."""
    clipped = {clips.label for clips in page.contents.clips}
    runs = [row.run for row in page.rows if row.row.label in clipped]
    return any(episode.obeyed_shown_mask is not None for run in runs for episode in run.episodes)


def _tables(section: PageSection) -> Iterator[str]:
    """Lay out what decides, beside the paper's figures; the other measures; and the differences to the reference."""
    if not section.rows:
        return
    measures = section.rows[0].run.measures
    compared = [measures.column(key) for key in measures.compared]
    yield _table(section.rows, [cell for column in compared for cell in _beside_paper(column, section.rows)])
    others = [
        column
        for column in measures.columns
        if column not in compared and any(row[column.key] is not None for row in section.rows)
    ]
    yield _table(section.rows, [(_full_header(column), _values(column, section.rows)) for column in others])
    for column in compared:
        if lines := _differences(section, column):
            minus = f"{column.header} minus `{section.differences[0].reference}`"
            yield markdown_table(["setting", *measures.setting, "scenes", "seeds", minus, "p", "p, Holm"], lines)


def _table(rows: Sequence[PageRow], columns: Sequence[tuple[str, list[str]]]) -> str:
    """Lay out columns, each with its header, behind the names of the rows."""
    names = [[row.row.about, *row.setting.values(), str(len(row.run.episodes)), row.seeds] for row in rows]
    values = zip(*(cells for _, cells in columns), strict=True)
    header = ["setting", *rows[0].setting, "n", "seeds", *(header for header, _ in columns)]
    return markdown_table(header, [[*name, *cells] for name, cells in zip(names, values, strict=True)])


def _beside_paper(column: Column, rows: Sequence[PageRow]) -> list[tuple[str, list[str]]]:
    figures = [row.row.paper.get(column.key) for row in rows]
    paper = ("paper", ["-" if figure is None else f"{figure:g}" for figure in figures])
    return [(column.header, _values(column, rows)), *([paper] if any(f is not None for f in figures) else [])]


def _values(column: Column, rows: Sequence[PageRow]) -> list[str]:
    return [value_text(column, row[column.key]) for row in rows]


def _full_header(column: Column) -> str:
    return f"{column.header}: {' / '.join(column.words)}" if column.kind is Kind.COUNTS else column.header


def _differences(section: PageSection, column: Column) -> list[list[str]]:
    rows = {row.row.label: row for row in section.rows}
    return [
        [
            rows[compared.label].row.about,
            *rows[compared.label].setting.values(),
            str(compared.scenes),
            compared.seeds,
            *difference_cells(column, difference),
            p_text(difference.p_corrected),
        ]
        for compared in section.differences
        for difference in compared.differences
        if difference.measure == column.key
    ]


def _points(page: ResultPage) -> list[list[str]]:
    return [
        [
            curve.label,
            ", ".join(f"{header} {words}" for header, words in point.run.setting.items()),
            str(point.step),
            _number(point.minutes, ".1f"),
            str(point.n),
            interval_text(point.success, scale=100.0),
        ]
        for curve in page.curves
        for point in curve.points
    ]


def _training(training: TrainingFacts) -> list[str]:
    held_out = f" ({training.held_out} held out)" if training.held_out else ""
    return [
        training.name,
        training.dataset,
        f"{_number(training.demonstrations)}{held_out}",
        _number(training.steps),
        str(training.batch_size),
        _number(training.samples),
        _number(training.minutes, ".1f"),
        _number(training.seed),
        (training.commit or "-")[:9],
    ]


def _number(value: float | None, form: str = "") -> str:
    return "-" if value is None else format(value, form)


def _legend(page: ResultPage) -> list[str]:
    """Explain the measures, task by task."""
    tasks = {row.run.task: row.run.measures for row in page.rows}
    return [
        f"{task}: {line}" if len(tasks) > 1 else line
        for task, measures in tasks.items()
        for line in measures.legend(_operator(page, task))
    ]


def _operator(page: ResultPage, task: str) -> str | None:
    """Return who played in the run that a task's efficiencies are related to; None without one."""
    named = {section.section.operator for section in page.sections}
    played = [row.run.first.operator for row in page.rows if row.row.label in named and row.run.task == task]
    return (played[0] or "not stated") if played else None


def _versions(page: ResultPage) -> str:
    packages = [origin.packages for row in page.rows for origin in row.origins.values() if origin.packages]
    found = {tuple(sorted(versions.items())) for versions in packages}
    return "; or ".join(", ".join(f"{k} {v}" for k, v in versions) for versions in sorted(found))


def _commands(page: ResultPage) -> list[tuple[str, str]]:
    """Return the known commands, each with a heading, those of the trainings first."""
    trainings = [
        (f"training {training.name}, seed {_number(training.seed)}", training.command)
        for training in page.trainings
        if training.command
    ]
    parts = [part for row in page.rows for part in row.parts]
    return trainings + [(_heading(*part), part[2].command) for part in parts if part[2].command]


def _heading(name: str, evaluation: Evaluation, origin: EvaluationOrigin) -> str:
    changed = " and changes" if origin.modified else ""
    commit = f", commit {origin.commit[:9]}{changed}" if origin.commit else ""
    return f"{name}, seed {_number(evaluation.seed)}{commit}"


def _by_hand(page: ResultPage) -> list[str]:
    """Name what has no known command."""
    trainings = [f"training {training.name}" for training in page.trainings if not training.command]
    parts = [part for row in page.rows for part in row.parts]
    return trainings + [
        f"{name} (seed {_number(evaluation.seed)})" for name, evaluation, origin in parts if not origin.command
    ]
