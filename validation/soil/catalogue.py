"""All experiments, in the order of the report."""

from lerobot_excav.errors import require_choice
from validation.soil import (
    blade_force,
    column_collapse,
    determinism,
    earthmoving_factors,
    force_ramp,
    free_fall,
    heap,
    ledger,
    operator_cycle,
    speed,
    stall,
)
from validation.soil.experiment import SoilExperiment

EXPERIMENTS: tuple[SoilExperiment, ...] = (
    column_collapse.EXPERIMENT,
    heap.EXPERIMENT,
    blade_force.EXPERIMENT,
    earthmoving_factors.EXPERIMENT,
    operator_cycle.EXPERIMENT,
    free_fall.EXPERIMENT,
    ledger.EXPERIMENT,
    determinism.EXPERIMENT,
    speed.EXPERIMENT,
    stall.EXPERIMENT,
    force_ramp.EXPERIMENT,
)


def chosen(codes: str | None) -> list[SoilExperiment]:
    """Return experiments by their codes, in the order of the report.

    Args:
        codes: Codes separated by commas; None for all.

    Raises:
        ConfigurationError: A code is unknown.
    """
    by_code = {experiment.code: experiment for experiment in EXPERIMENTS}
    names = list(by_code) if codes is None else [name.strip() for name in codes.split(",")]
    for name in names:
        require_choice("--only", name, by_code)
    return [experiment for code, experiment in by_code.items() if code in names]
