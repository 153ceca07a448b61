"""All experiments, in the order of the report."""

from importlib import import_module

from lerobot_excav.errors import require_choice
from validation.soil.experiment import SoilExperiment

_FILES = (
    *(
        "column_collapse",
        "wall_collapse",
        "ridge",
        "standing_cut",
        "heap",
        "blade_force",
        "earthmoving_factors",
        "operator_cycle",
        "free_fall",
    ),
    *("ledger", "determinism", "speed", "stall", "force_ramp"),
)
EXPERIMENTS: tuple[SoilExperiment, ...] = tuple(import_module(f"validation.soil.{f}").run for f in _FILES)


def chosen(codes: str | None) -> list[SoilExperiment]:
    """Return experiments by their codes, which commas separate, in the order of the report; None for all.

    Raises:
        ConfigurationError: A code is unknown.
    """
    by_code = {experiment.code: experiment for experiment in EXPERIMENTS}
    names = list(by_code) if codes is None else [name.strip() for name in codes.split(",")]
    for name in names:
        require_choice("--only", name, by_code)
    return [experiment for code, experiment in by_code.items() if code in names]
