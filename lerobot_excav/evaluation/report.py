"""Tables of evaluations: one row per run, with intervals, and the differences between runs."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.evaluation.comparison import (
    Difference,
    compare,
    difference_of_worlds,
    matched,
    means_by_key,
)
from lerobot_excav.evaluation.metrics import Run
from lerobot_excav.evaluation.statistics import Interval, bootstrap_mean, bootstrap_ratio, wilson_interval


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """One row of a report.

    Attributes:
        label: Name of the run.
        episodes: Number of episodes, over all seeds.
        seeds: Number of evaluations, one per training seed.
        scenes: Number of scenes and targets.
        mask_condition: Which mask was shown.
        simulation_version: Version of the simulation.
        soil: Soil preset.
        fidelity: Numerical effort of the soil.
        target_success: Rate, Wilson interval over episodes.
        full_success: Rate, Wilson interval over episodes.
        retained_mass_kg: Mean [kg], bootstrap interval over scenes and targets.
        residual_bucket_mass_kg: Mean [kg], bootstrap interval over scenes and targets.
        hard_contact: Rate of episodes with a hard contact, Wilson interval.
        spill: Rate of episodes that lost soil on the way, Wilson interval.
        efficiency: Retained mass over the operator's on the same scenes and targets; None without operator.
    """

    label: str
    episodes: int
    seeds: int
    scenes: int
    mask_condition: str
    simulation_version: int
    soil: str
    fidelity: str
    target_success: Interval
    full_success: Interval
    retained_mass_kg: Interval
    residual_bucket_mass_kg: Interval
    hard_contact: Interval
    spill: Interval
    efficiency: Interval | None


@dataclass(frozen=True, kw_only=True)
class Report:
    """Everything a report says.

    Attributes:
        runs: One row per run, the operator's last.
        differences: By `second - first`, the paired differences to the first run.
        operator: Who dug in the operator's run; None without one.
        bootstrap_seed: Seed of all resampling.
        notes: What a reader has to know about the files.
    """

    runs: list[RunSummary]
    differences: dict[str, list[Difference]]
    operator: str | None
    bootstrap_seed: int
    notes: list[str]

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain data."""
        return asdict(self)


def make_report(runs: list[Run], *, operator: Run | None = None, seed: int = 0) -> Report:
    """Summarise runs and compare each with the first; a run on another soil has other scenes and is not compared.

    Args:
        runs: At least one run.
        operator: The operator's run, on at least the same scenes and targets.
        seed: Seed of the bootstrap.

    Raises:
        DatasetError: Runs of one soil show different scenes or targets, or the operator dug another soil than a run.
    """
    rng = np.random.default_rng(seed)
    rows = [*runs, *([operator] if operator else [])]
    unlike = {run.label: difference_of_worlds(runs[0], run) for run in runs[1:]}
    return Report(
        runs=[_summarise(run, operator, rng) for run in rows],
        differences={
            f"{run.label} - {runs[0].label}": compare(runs[0], run, rng)
            for run in runs[1:]
            if not unlike[run.label]
        },
        operator=_who(operator) if operator else None,
        bootstrap_seed=seed,
        notes=[
            *(note for run in rows for note in _notes(run)),
            *(f"no paired differences to {label}: {reason}" for label, reason in unlike.items() if reason),
        ],
    )


def _summarise(run: Run, operator: Run | None, rng: np.random.Generator) -> RunSummary:
    episodes = run.episodes

    def rate(outcomes: list[bool]) -> Interval:
        return wilson_interval(sum(outcomes), len(outcomes))

    retained = means_by_key(run, "retained_mass_kg")
    return RunSummary(
        label=run.label,
        episodes=len(episodes),
        seeds=len(run.evaluations),
        scenes=len(run.keys),
        mask_condition=episodes[0].mask_condition,
        simulation_version=run.simulation_version,
        soil=run.soil,
        fidelity=episodes[0].fidelity,
        target_success=rate([episode.target_success for episode in episodes]),
        full_success=rate([episode.is_success for episode in episodes]),
        retained_mass_kg=bootstrap_mean(retained, rng),
        residual_bucket_mass_kg=bootstrap_mean(means_by_key(run, "residual_bucket_mass_kg"), rng),
        hard_contact=rate([episode.hard_target_contacts > 0 for episode in episodes]),
        spill=rate([episode.spill_before_target_events > 0 for episode in episodes]),
        efficiency=None if operator is None else bootstrap_ratio(retained, matched(run, operator), rng),
    )


def _who(operator: Run) -> str:
    return operator.evaluations[0].operator or "not stated"


def _notes(run: Run) -> list[str]:
    return [
        f"{evaluation.path} holds {evaluation.of} evaluations; the last one is used"
        for evaluation in run.evaluations
        if evaluation.of > 1
    ]


def write_report(report: Report, markdown: str, folder: Path) -> None:
    """Write `report.md` and `report.json` into a folder, which is made.

    Args:
        report: The report.
        markdown: Its text.
        folder: Where to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.md").write_text(markdown)
    (folder / "report.json").write_text(json.dumps(report.as_dict(), indent=1) + "\n")
