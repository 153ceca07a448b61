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

EXPERIMENTS: tuple[SoilExperiment, ...] = tuple(
    module.EXPERIMENT
    for module in (
        column_collapse,
        heap,
        blade_force,
        earthmoving_factors,
        operator_cycle,
        free_fall,
        ledger,
        determinism,
        speed,
        stall,
        force_ramp,
    )
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
