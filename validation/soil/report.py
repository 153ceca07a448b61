"""The report of the validation as Markdown, and its lines for a terminal."""

import importlib.metadata
import os
import platform
from pathlib import Path

from jinja2 import FileSystemLoader

from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.evaluation.markdown import templates
from lerobot_excav.whole_file import write_whole
from validation.soil.experiment import Conditions, SoilExperiment
from validation.soil.plots import draw
from validation.soil.results import Result, number_text

IMAGE_FOLDER = Path("images", "soil")
"""Where the plots lie, seen from the report."""

Outcome = tuple[SoilExperiment, Result]


def write_report(outcomes: list[Outcome], conditions: Conditions, path: Path) -> None:
    """Write the report as Markdown, and its plots beside it; folders are made."""
    images = path.parent / IMAGE_FOLDER
    images.mkdir(parents=True, exist_ok=True)
    for _, result in outcomes:
        for plot in result.plots:
            draw(plot, images / f"{plot.name}.png")
    write_whole(path, report_text(outcomes, conditions))


def is_report(path: Path) -> bool:
    """Return whether a file is a report of an earlier run, by the line that says so."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return "Written by `python -m validation.soil" in file.read(500)


def report_text(outcomes: list[Outcome], conditions: Conditions) -> str:
    """Return the report of experiments that ran under some conditions."""
    environment = templates(FileSystemLoader(Path(__file__).parent))
    environment.filters["number"] = number_text
    checks = [check for _, result in outcomes for check in result.checks]
    version, simulation = importlib.metadata.version("lerobot_env_excav"), task_spec("task", "Scoop-v0")
    return environment.get_template("report.md.jinja").render(
        outcomes=outcomes,
        conditions=conditions,
        inside=sum(check.passed for check in checks),
        total=len(checks),
        software=f"lerobot_env_excav {version}, version {simulation.simulation_version} of the simulation",
        machine=f"{platform.machine()} with {os.cpu_count()} cores",
        images=IMAGE_FOLDER.as_posix(),
    )


def summary_text(experiment: SoilExperiment, result: Result) -> str:
    """Return one line per gated value, for a terminal."""
    lines = []
    for check in result.checks:
        line = f"{experiment.name:20} {check.name:62} {check.text(check.value):>14}   gate {check.gate_text}"
        lines.append(line if check.passed else f"{line}   MISSED by {check.text(check.missed_by)}")
    return "\n".join(lines)
