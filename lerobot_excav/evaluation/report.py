"""Tables of evaluations: one row per run, with intervals, and the differences between runs."""

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np

from lerobot_excav.evaluation.comparison import Difference, compare, difference_of_worlds, require_same_task
from lerobot_excav.evaluation.report_folder import ReportFolder
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.run_summary import RunSummary, measured
from lerobot_excav.whole_file import write_whole

FIGURE = "figure_"
"""What the names of figures begin with."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """Everything a report says.

    Attributes:
        runs: One row per run, the operator's last.
        differences: By `second - first`, the paired differences to the first run.
        operator: Who played in the operator's run; None without one.
        notes: What a reader has to know about the files.
    """

    runs: list[RunSummary]
    differences: dict[str, list[Difference]]
    operator: str | None
    bootstrap_seed: int
    notes: list[str]

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data."""
        return asdict(replace(self, runs=[])) | {"runs": [run.as_dict() for run in self.runs]}


def make_report(runs: list[Run], *, operator: Run | None = None, seed: int = 0) -> Report:
    """Summarise runs and compare each with the first; a run of another world has other scenes and is not compared.

    The operator's run is on at least the same scenes and targets; `seed` is that of the bootstrap.

    Raises:
        DatasetError: Runs are of different tasks, those of one world show different scenes or targets, or the
            operator played another world than a run.
    """
    rng = np.random.default_rng(seed)
    rows = [*runs, *([operator] if operator else [])]
    for run in rows[1:]:
        require_same_task(rows[0], run)
    unlike = {run.label: difference_of_worlds(runs[0], run) for run in runs[1:]}
    return Report(
        runs=[RunSummary(run=run, values=measured(run, operator, rng)) for run in rows],
        differences={
            f"{run.label} - {runs[0].label}": compare(runs[0], run) for run in runs[1:] if not unlike[run.label]
        },
        operator=(operator.first.operator or "not stated") if operator else None,
        bootstrap_seed=seed,
        notes=[
            *(note for run in rows for note in file_notes(run)),
            *(f"no paired differences to {label}: {reason}" for label, reason in unlike.items() if reason),
        ],
    )


def file_notes(run: Run) -> list[str]:
    """Say which files of a run hold more than was used of them."""
    return [
        f"{evaluation.path} holds {evaluation.of} evaluations; the last one is used"
        for evaluation in run.evaluations
        if evaluation.of > 1
    ]


def write_report(report: Report, markdown: str, folder: Path) -> list[Path]:
    """Write a report as `report.json`, and its text as `report.md`, into a folder, which is made; return what it wrote.

    Where the task has a figure, one is drawn for every run, and shown at the end of the text. Figures of an earlier
    report are removed.

    Raises:
        DatasetError: A file of that name was not written by a report, or was changed since.
    """
    figures = figure_names([row.run for row in report.runs])
    shown = "".join(f"\n![{run.label}]({name})\n" for name, run in figures.items())
    destination = ReportFolder(folder)
    with destination.staged() as stage:
        write_whole(stage / "report.md", markdown + shown)
        write_whole(stage / "report.json", json.dumps(report.as_dict(), indent=1) + "\n")
        for name, run in figures.items():
            resolve_name(run.measures.figure_entry or "")(run.episodes, stage / name)
    destination.remove(lambda name: name.startswith(FIGURE) and name not in figures)
    return [folder / name for name in ("report.md", "report.json", *figures)]


def figure_names(runs: Sequence[Run]) -> dict[str, Run]:
    """Return the runs that have a figure, by the name of its file; labels may hold what is not for file names."""
    figures: dict[str, Run] = {}
    for run in (run for run in runs if run.measures.figure_entry is not None):
        stem = name = f"{FIGURE}{re.sub(r'[^A-Za-z0-9_.-]+', '_', run.label)}"
        number = 1
        while f"{name}.png" in figures:
            number += 1
            name = f"{stem}_{number}"
        figures[f"{name}.png"] = run
    return figures
