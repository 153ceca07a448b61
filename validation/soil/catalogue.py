"""All experiments, in the order of the report."""

from importlib import import_module

from lerobot_excav.errors import require_choice
from validation.soil.experiment import SoilExperiment

_FILES = (
    *("column_collapse", "wall_collapse", "ridge", "standing_cut", "heap", "blade_force", "earthmoving_factors"),
    *("moving_blade", "bucket_drags", "drag_rate", "filled_bucket", "digging_work", "operator_cycle", "free_fall"),
    *("ledger", "determinism", "stall", "force_ramp", "speed", "newton_peer"),
)
EXPERIMENTS: tuple[SoilExperiment, ...] = tuple(import_module(f"validation.soil.{f}").run for f in _FILES)


def chosen(given: str | None) -> list[SoilExperiment]:
    """Return experiments by their names, which commas separate, in the order of the report; None for all.

    Raises:
        ConfigurationError: A name is unknown.
    """
    by_name = {experiment.name: experiment for experiment in EXPERIMENTS}
    names = list(by_name) if given is None else [name.strip() for name in given.split(",")]
    for name in names:
        require_choice("--only", name, by_name)
    return [experiment for name, experiment in by_name.items() if name in names]
