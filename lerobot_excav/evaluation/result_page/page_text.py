"""A result page in words: Markdown whose tables read well unrendered."""

from collections.abc import Sequence

from lerobot_excav.evaluation.report_text import (
    difference_cells,
    markdown_table,
    simulations,
    value_text,
)
from lerobot_excav.evaluation.result_page.contents import Clips
from lerobot_excav.evaluation.result_page.curves import Curve, CurvePoint
from lerobot_excav.evaluation.result_page.page import PageDifference, PageRow, PageSection, ResultPage
from lerobot_excav.evaluation.task_table import Column, Kind, TaskTable
from lerobot_excav.evaluation.training import Training

CURVE_PLOT = "success.png"
VIDEO_GRID = "rollouts.mp4"


def page_text(page: ResultPage, *, files: Sequence[str] = (), clips: Sequence[Clips] | None = None) -> str:
    """Write a page as Markdown.

    Args:
        page: The page.
        files: Names of the plots and videos that lie beside it.
        clips: What the video grid shows, from top to bottom; None: all that the contents name.
    """
    parts = [f"# {page.contents.title}", "", *_paragraph(page.contents.text)]
    for section in page.sections:
        parts += _section(section)
    if not page.rows:
        return "\n".join([*parts, "Nothing has been run yet.", ""])
    parts += _curves(page.curves, files)
    if VIDEO_GRID in files:
        shown = page.contents.clips if clips is None else clips
        parts += ["## Rollouts", "", *_video(shown), ""]
    parts += _trainings(page)
    parts += ["## How to read this", "", *(f"- {line}" for line in _legend(page)), ""]
    parts += _commands(page)
    return "\n".join(parts)


def _paragraph(text: str) -> list[str]:
    return [text.strip(), ""] if text.strip() else []


def _section(section: PageSection) -> list[str]:
    parts = [f"## {section.section.title}", "", *_paragraph(section.section.text)]
    if section.rows:
        parts += [*_outcomes(section.rows), "", *_choices(section.rows), ""]
    if section.differences:
        parts += [*_differences(section), ""]
    if section.missing:
        parts += [f"Not run: {', '.join(section.missing)}.", ""]
    return parts


def _outcomes(rows: Sequence[PageRow]) -> list[str]:
    """Lay out what decides, beside the paper's figures."""
    table = rows[0].summary.table
    columns = [table.column(key) for key in table.compared]
    in_paper = [column for column in columns if any(column.key in (row.row.paper or {}) for row in rows)]
    header = ["setting", *table.setting, "n"]
    for column in columns:
        header += [column.header, *(["paper"] if column in in_paper else [])]
    return markdown_table(header, [[*_name(row), *_outcome_cells(row, columns, in_paper)] for row in rows])


def _name(row: PageRow) -> list[str]:
    return [row.row.about, *row.summary.setting.values(), str(row.summary.episodes)]


def _outcome_cells(row: PageRow, columns: Sequence[Column], in_paper: Sequence[Column]) -> list[str]:
    cells = []
    for column in columns:
        cells.append(value_text(column, row.summary[column.key]))
        if column in in_paper:
            figure = (row.row.paper or {}).get(column.key)
            cells.append("-" if figure is None else f"{figure:g}")
    return cells


def _choices(rows: Sequence[PageRow]) -> list[str]:
    """Lay out the other measures."""
    table = rows[0].summary.table
    # A page has no operator's run to relate anything to.
    columns = [c for c in table.columns if c.key not in table.compared and c.kind is not Kind.RATIO]
    header = ["setting", *table.setting, "n", *(_full_header(column) for column in columns)]
    return markdown_table(
        header,
        [[*_name(row), *(value_text(c, row.summary[c.key]) for c in columns)] for row in rows],
    )


def _full_header(column: Column) -> str:
    return f"{column.header}: {' / '.join(column.words)}" if column.kind is Kind.COUNTS else column.header


def _differences(section: PageSection) -> list[str]:
    rows = {row.row.label: row for row in section.rows}
    lines = [_difference(rows[d.label], d) for d in section.differences if d.differences]
    if not lines:
        return []
    reference = section.differences[0].reference
    table = section.rows[0].summary.table
    header = ["setting", *table.setting, "scenes", f"{_decisive(table).header} minus `{reference}`", "p"]
    return markdown_table(header, lines)


def _difference(row: PageRow, difference: PageDifference) -> list[str]:
    column = _decisive(row.summary.table)
    decisive = next(d for d in difference.differences if d.measure == column.field)
    return [
        row.row.about,
        *row.summary.setting.values(),
        str(difference.scenes),
        *difference_cells(column, decisive),
    ]


def _decisive(table: TaskTable) -> Column:
    """Return the first rate that is compared."""
    return next(column for key in table.compared if (column := table.column(key)).kind is Kind.RATE)


def _curves(curves: Sequence[Curve], files: Sequence[str]) -> list[str]:
    if not curves:
        return []
    rows = [_point(curve, point) for curve in curves for point in curve.points]
    sets = sorted({point.scene_set for curve in curves for point in curve.points})
    return [
        f"## Success against training, on `{'`, `'.join(sets)}` scenes",
        "",
        *(
            [f"![Success against training steps and minutes]({CURVE_PLOT})", ""]
            if CURVE_PLOT in files
            else []
        ),
        *markdown_table(("policy", "played with", "step", "minutes", "n", "success [%]"), rows),
        "",
    ]


def _point(curve: Curve, point: CurvePoint) -> list[str]:
    success = value_text(_SUCCESS, point.success)
    return [curve.label, point.setting, str(point.step), _number(point.minutes), str(point.n), success]


_SUCCESS = Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def _video(shown: Sequence[Clips]) -> list[str]:
    lines = [f"[{VIDEO_GRID}]({VIDEO_GRID}), the mask tinted; from top to bottom:", ""]
    return [
        *lines,
        *(f"- `{clips.label}`, episodes {_list(clips.episodes)}" for clips in shown),
    ]


def _list(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))


def _trainings(page: ResultPage) -> list[str]:
    if not page.trainings:
        return []
    header = ("training", "data", "demonstrations", "steps", "batch", "samples", "minutes", "seed", "commit")
    rows = [_training(training) for training in page.trainings]
    note = "Minutes of wall time, with whatever else ran beside: another training, where two stages were run at a time."
    return ["## Training", "", *markdown_table(header, rows), "", note, ""]


def _training(training: Training) -> list[str]:
    held_out = f" ({training.held_out} held out)" if training.held_out else ""
    return [
        training.name,
        training.dataset,
        f"{_or_dash(training.demonstrations)}{held_out}",
        _or_dash(training.steps),
        str(training.batch_size),
        _or_dash(training.samples),
        _number(training.minutes),
        _or_dash(training.seed),
        (training.commit or "-")[:9],
    ]


def _or_dash(value: int | None) -> str:
    return "-" if value is None else str(value)


def _legend(page: ResultPage) -> list[str]:
    lines = [
        "Brackets: 95 % intervals; Wilson's for rates over episodes, bootstrap for means over scenes and targets "
        f"(seed {page.bootstrap_seed}).",
        *_measures(page),
        "Differences are paired by scene and target, on the scenes that both have played; with Newcombe's interval for "
        "paired rates, p from McNemar's exact test.",
        "One training seed per policy: the intervals say nothing about how trainings differ.",
        f"Simulation: {simulations([row.summary for row in page.rows])}.",
        "Machine-readable: [report.json](report.json), a line per row in [rows.jsonl](rows.jsonl); every episode: "
        "[metrics](metrics).",
        *(f"{note}." for note in page.notes),
    ]
    versions = _packages(page)
    return [*lines, f"Versions: {versions}."] if versions else lines


def _measures(page: ResultPage) -> list[str]:
    """Explain the measures, task by task."""
    tables = {row.summary.table.task: row.summary.table for row in page.rows}
    return [
        f"{task}: {line}" if len(tables) > 1 else line
        for task, table in tables.items()
        for line in table.legend(None)
    ]


def _packages(page: ResultPage) -> str:
    found = {
        tuple(sorted(row.provenance.record.packages.items())) for row in page.rows if row.provenance.record
    }
    return "; or ".join(", ".join(f"{k} {v}" for k, v in packages) for packages in sorted(found))


def _commands(page: ResultPage) -> list[str]:
    """List the commands, those of the trainings first, and name what has none."""
    parts = []
    for training in page.trainings:
        if training.command:
            parts += [f"# training {training.name}, seed {_or_dash(training.seed)}", training.command, ""]
    for row in page.rows:
        record = row.provenance.record
        if record is not None:
            changed = " and changes" if record.modified else ""
            commit = f", commit {record.commit[:9]}{changed}" if record.commit else ""
            parts += [f"# {row.row.label}, seed {_or_dash(row.seed)}{commit}", record.command, ""]
    by_hand = [f"training {training.name}" for training in page.trainings if not training.command]
    by_hand += [
        f"{row.row.label} (seed {_or_dash(row.seed)})" for row in page.rows if row.provenance.record is None
    ]
    note = (
        "A command works on a folder `….partial`, which has lost that ending once the command had succeeded."
    )
    return [
        *(["## Commands", "", note, "", "```bash", *parts[:-1], "```", ""] if parts else []),
        *([f"Run by hand, without a record of the command: {', '.join(by_hand)}.", ""] if by_hand else []),
    ]
