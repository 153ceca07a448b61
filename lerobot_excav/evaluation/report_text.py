"""A report in words: tables that read as plain text and as Markdown alike."""

from collections.abc import Sequence

from lerobot_excav.evaluation.comparison import Difference
from lerobot_excav.evaluation.report import Report
from lerobot_excav.evaluation.run_summary import RateOf, RunSummary, Value
from lerobot_excav.evaluation.statistics import Interval
from lerobot_excav.evaluation.task_table import Column, Kind, TaskTable


def report_text(report: Report) -> str:
    """Write a report as Markdown."""
    table = report.runs[0].table
    header = ["run", *table.setting, "n", "seeds", *(column.header for column in table.columns)]
    parts = ["# Evaluation", "", *markdown_table(header, [_row(run) for run in report.runs]), ""]
    for name, differences in report.differences.items():
        rows = [_change(table, difference) for difference in differences]
        parts += [f"## {name}", "", *markdown_table(("measure", "difference", "p"), rows), ""]
    return "\n".join([*parts, *(f"- {line}" for line in _legend(report)), ""])


def _legend(report: Report) -> list[str]:
    lines = [
        "Brackets: 95 % intervals; Wilson's for rates over episodes, bootstrap for means over scenes and targets "
        f"(seed {report.bootstrap_seed}).",
        "n: episodes over all training seeds.",
        f"Simulation: {simulations(report.runs)}.",
        *report.runs[0].table.legend(report.operator),
    ]
    ratios = [column.header for column in report.runs[0].table.columns if column.kind is Kind.RATIO]
    if ratios and report.operator is None:
        lines.append(f"For {', '.join(ratios)} give an operator's run on the same scenes: --operator=FILE.")
    if report.differences:
        lines.append(
            "Differences are paired by scene and target; those of rates with Newcombe's interval and p from McNemar's "
            "exact test (single seeds only), others with the bootstrap's interval."
        )
    return [*lines, *report.notes]


def simulations(runs: Sequence[RunSummary]) -> str:
    """Describe the simulation, run by run if they differ."""
    by_run = {run.label: run.table.simulation.format(**run.constants) for run in runs}
    if len(set(by_run.values())) == 1:
        return next(iter(by_run.values()))
    return "; ".join(f"{label}: {text}" for label, text in by_run.items())


def _row(run: RunSummary) -> list[str]:
    values = (value_text(column, run.values[column.key]) for column in run.table.columns)
    return [run.label, *run.setting.values(), str(run.episodes), str(run.seeds), *values]


def _change(table: TaskTable, change: Difference) -> list[str]:
    column = next(table.column(key) for key in table.compared if table.column(key).field == change.measure)
    return [column.header, *difference_cells(column, change)]


def difference_cells(column: Column, change: Difference) -> list[str]:
    """Write a difference and its p-value."""
    p_value = "-" if change.p_value is None else f"{change.p_value:.3g}"
    return [_interval(change.difference, scale=column.scale, sign="+"), p_value]


def value_text(column: Column, value: Value) -> str:
    """Write the value of a column, with its interval and, if it is a rate of some episodes only, their number."""
    if value is None:
        return "-"
    if isinstance(value, dict):
        return " / ".join(str(value[word]) for word in column.words)
    of = f" of {value.n}" if isinstance(value, RateOf) else ""
    return _interval(value, scale=column.scale) + of


def _interval(interval: Interval, *, scale: float = 1.0, sign: str = "") -> str:
    low, estimate, high = (scale * value for value in (interval.low, interval.estimate, interval.high))
    return f"{estimate:{sign}.1f} [{low:{sign}.1f}, {high:{sign}.1f}]"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lay out a table whose columns line up, so that it reads well unrendered."""
    widths = [max(len(cells[i]) for cells in [header, *rows]) for i in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)) + " |"

    return [line(header), line(["-" * width for width in widths]), *(line(row) for row in rows)]
