"""The report of the validation as Markdown."""

import importlib.metadata
import os
import platform
from pathlib import Path

from lerobot_excav.envs.tasks.registry import task_spec

from validation.soil.experiment import Conditions, SoilExperiment
from validation.soil.plots import draw
from validation.soil.results import Check, Result, Table, number_text

IMAGE_FOLDER = Path("images", "soil")
"""Where the plots lie, seen from the report."""

Outcome = tuple[SoilExperiment, Result]


def write_report(outcomes: list[Outcome], conditions: Conditions, path: Path) -> None:
    """Write the report, and its plots beside it.

    Args:
        outcomes: Experiments and what they found.
        conditions: Under which they ran.
        path: Markdown file; folders are made.
    """
    images = path.parent / IMAGE_FOLDER
    images.mkdir(parents=True, exist_ok=True)
    for _, result in outcomes:
        for plot in result.plots:
            draw(plot, images / f"{plot.name}.png")
    path.write_text(report_text(outcomes, conditions))


def report_text(outcomes: list[Outcome], conditions: Conditions) -> str:
    """Return the report."""
    parts = [_introduction(conditions, outcomes), _summary(outcomes)]
    parts += [_section(experiment, result) for experiment, result in outcomes]
    return "\n\n".join(parts) + "\n"


def summary_text(outcomes: list[Outcome]) -> str:
    """Return one line per gated value, for a terminal."""
    lines = []
    for experiment, result in outcomes:
        for check in result.checks:
            shown = f"{number_text(check.value)} {check.unit}".rstrip()
            line = f"{experiment.code:4} {check.name:62} {shown:>14}   gate {_gate(check)}"
            lines.append(line if check.passed else f"{line}   MISSED by {_missed(check)}")
    return "\n".join(lines)


def _introduction(conditions: Conditions, outcomes: list[Outcome]) -> str:
    missed = sum(len(result.missed) for _, result in outcomes)
    total = sum(len(result.checks) for _, result in outcomes)
    seeds = ", ".join(map(str, conditions.seeds))
    command = "python -m validation.soil --report"
    return (
        "# Soil against published experiments\n\n"
        f"Written by `{command}`; do not edit it. {total - missed} of {total} gated values are inside "
        "their gates"
        + (", all of them.\n\n" if missed == 0 else f", {missed} are not; each says by how much, and why.\n\n")
        + f"Conditions: soil `{conditions.preset}` where an experiment does not name its own, fidelity "
        f"`{conditions.fidelity}`, seeds {seeds}"
        + (", quick (fewer repetitions)" if conditions.quick else "")
        + f"; lerobot_env_excav {importlib.metadata.version('lerobot_env_excav')}, version {task_spec('task', 'Scoop-v0').simulation_version} "
        "of the simulation, "
        f"{platform.machine()} with {os.cpu_count()} cores.\n\n"
        "How the soil works: [soil.md](soil.md). Every experiment is one file in "
        "`validation/soil/` and uses the soil's public surface only."
    )


def _summary(outcomes: list[Outcome]) -> str:
    lines = ["| | experiment | inside | missed |", "|---|---|---|---|"]
    for experiment, result in outcomes:
        inside = f"{len(result.checks) - len(result.missed)} of {len(result.checks)}"
        missed = "; ".join(f"{check.name} by {_missed(check)}" for check in result.missed) or "–"
        anchor = f"#{experiment.code.lower()}-{experiment.title.lower().replace(' ', '-')}"
        anchor = "".join(c for c in anchor if c.isalnum() or c in "#-")
        lines.append(f"| {experiment.code} | [{experiment.title}]({anchor}) | {inside} | {missed} |")
    return "\n".join(lines)


def _section(experiment: SoilExperiment, result: Result) -> str:
    parts = [
        f"## {experiment.code} {experiment.title}",
        f"{experiment.measures}\n\nSource: {experiment.source}.\n\nGate: {experiment.gate}",
        _checks(result.checks),
    ]
    parts += [_reason(experiment, check) for check in result.missed]
    parts += [f"![{plot.title}]({(IMAGE_FOLDER / plot.name).as_posix()}.png)" for plot in result.plots]
    parts += [_table(table) for table in result.tables]
    parts += list(result.remarks)
    return "\n\n".join(parts)


def _checks(checks: tuple[Check, ...]) -> str:
    lines = ["| value | measured | gate | |", "|---|---|---|---|"]
    for check in checks:
        verdict = "inside" if check.passed else f"**missed** by {_missed(check)}"
        measured = f"{number_text(check.value)} {check.unit}".rstrip()
        lines.append(f"| {check.name} | {measured} | {_gate(check)} | {verdict} |")
    return "\n".join(lines)


def _gate(check: Check) -> str:
    return f"{check.gate_text} {check.unit}".rstrip()


def _missed(check: Check) -> str:
    return f"{number_text(check.missed_by)} {check.unit}".rstrip()


def _reason(experiment: SoilExperiment, check: Check) -> str:
    why = experiment.reason(check) or "Not explained yet."
    return f"**Missed: {check.name}**, by {_missed(check)}. {why}"


def _table(table: Table) -> str:
    lines = [_row(table.header), _row(("---",) * len(table.header))]
    lines += [_row(tuple(_cell(value) for value in row)) for row in table.rows]
    return "\n".join(lines)


def _cell(value: float | str) -> str:
    return value if isinstance(value, str) else number_text(value)


def _row(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
