"""A report in words: Markdown whose tables read well unrendered."""

from collections.abc import Sequence

from lerobot_excav.envs.tasks.measures import Kind
from lerobot_excav.evaluation.markdown import difference_cells, render, value_text
from lerobot_excav.evaluation.report import Report
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.run_summary import RunSummary


def report_text(report: Report) -> str:
    """Write a report as Markdown."""
    measures = report.runs[0].run.measures
    ratios = [column.header for column in measures.columns if column.kind is Kind.RATIO]
    return render(
        "report",
        seed=report.bootstrap_seed,
        sentences=sentences([row.run for row in report.runs]),
        header=["run", *measures.setting, "n", "seeds", *(column.header for column in measures.columns)],
        rows=[_row(row) for row in report.runs],
        differences={
            name: [
                [column.header, *difference_cells(column, difference)]
                for difference in differences
                for column in [measures.column(difference.measure)]
            ]
            for name, differences in report.differences.items()
        },
        simulations=simulations([row.run for row in report.runs]),
        measures=measures.legend(report.operator),
        lacks_operator=ratios if report.operator is None else [],
        notes=report.notes,
    )


def sentences(runs: Sequence[Run]) -> list[str]:
    """Say of each run in a sentence what came of it, where the task has words for it."""
    found = [(run.label, run.measures.sentence(run.episodes)) for run in runs if run.measures.sentence is not None]
    return [text if len(found) == 1 else f"{label}: {text}" for label, text in found]


def simulations(runs: Sequence[Run]) -> str:
    """Describe the simulation, run by run if they differ."""
    by_run = {run.label: run.measures.simulation.format(**run.constants) for run in runs}
    if len(set(by_run.values())) == 1:
        return next(iter(by_run.values()))
    return "; ".join(f"{label}: {text}" for label, text in by_run.items())


def _row(row: RunSummary) -> list[str]:
    values = (value_text(column, row[column.key]) for column in row.run.measures.columns)
    counts = (str(row.counts[name]) for name in ("episodes", "seeds"))
    return [row.run.label, *row.run.setting.values(), *counts, *values]
