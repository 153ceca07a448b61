"""A report in words: tables that read as plain text and as Markdown alike."""

from collections.abc import Sequence

from lerobot_excav.evaluation.comparison import RATES, Difference
from lerobot_excav.evaluation.report import Report, RunSummary
from lerobot_excav.evaluation.statistics import Interval

HEADER = (
    "run",
    "soil",
    "mask",
    "n",
    "seeds",
    "target success [%]",
    "full success [%]",
    "retained [kg]",
    "efficiency [%]",
    "residual [kg]",
    "hard contact [%]",
    "spill [%]",
)
MEASURE_NAMES = {
    "target_success": "target success [%]",
    "is_success": "full success [%]",
    "retained_mass_kg": "retained [kg]",
}


def report_text(report: Report) -> str:
    """Write a report as Markdown."""
    parts = ["# Evaluation", "", *_table(HEADER, [_row(run) for run in report.runs]), ""]
    for name, differences in report.differences.items():
        parts += [
            f"## {name}",
            "",
            *_table(("measure", "difference", "p"), [_change(d) for d in differences]),
            "",
        ]
    return "\n".join([*parts, *(f"- {line}" for line in _legend(report)), ""])


def _legend(report: Report) -> list[str]:
    lines = [
        "Brackets: 95 % intervals; Wilson's for rates over episodes, bootstrap for means over scenes and targets "
        f"(seed {report.bootstrap_seed}).",
        "n: episodes over all training seeds.",
        f"Simulation: {_simulations(report)}.",
    ]
    if report.operator is None:
        lines.append("Efficiency needs an operator's run on the same scenes: --operator=FILE.")
    else:
        lines.append(
            "Efficiency: retained mass over the operator's on the same scenes and targets; "
            f"operator: {report.operator}."
        )
    if report.differences:
        lines.append(
            "Differences are paired by scene and target; p from McNemar's exact test (single seeds only)."
        )
    return [*lines, *report.notes]


def _simulations(report: Report) -> str:
    """Name version of the simulation and fidelity of the soil, run by run if they differ."""
    by_run = {
        run.label: f"version {run.simulation_version}, {run.fidelity} fidelity of the soil"
        for run in report.runs
    }
    if len(set(by_run.values())) == 1:
        return next(iter(by_run.values()))
    return "; ".join(f"{label}: {text}" for label, text in by_run.items())


def _row(run: RunSummary) -> list[str]:
    return [
        run.label,
        run.soil,
        run.mask_condition,
        str(run.episodes),
        str(run.seeds),
        _interval(run.target_success, scale=100),
        _interval(run.full_success, scale=100),
        _interval(run.retained_mass_kg),
        "-" if run.efficiency is None else _interval(run.efficiency, scale=100),
        _interval(run.residual_bucket_mass_kg),
        _interval(run.hard_contact, scale=100),
        _interval(run.spill, scale=100),
    ]


def _change(change: Difference) -> list[str]:
    scale = 100.0 if change.measure in RATES else 1.0
    p_value = "-" if change.p_value is None else f"{change.p_value:.3g}"
    return [MEASURE_NAMES[change.measure], _interval(change.difference, scale=scale, sign="+"), p_value]


def _interval(interval: Interval, *, scale: float = 1.0, sign: str = "") -> str:
    low, estimate, high = (scale * value for value in (interval.low, interval.estimate, interval.high))
    return f"{estimate:{sign}.1f} [{low:{sign}.1f}, {high:{sign}.1f}]"


def _table(header: Sequence[str], rows: list[list[str]]) -> list[str]:
    """Lay out a table whose columns line up, so that it reads well unrendered."""
    widths = [max(len(cells[i]) for cells in [header, *rows]) for i in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)) + " |"

    return [line(header), line(["-" * width for width in widths]), *(line(row) for row in rows)]
