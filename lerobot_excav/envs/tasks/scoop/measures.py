"""What is measured of Scoop-v0; `docs/reference/metrics.md` defines the measures."""

from typing import TYPE_CHECKING, Any, override

from pydantic import NonNegativeInt

from lerobot_excav.envs.tasks.measures import Column, EpisodeRecord, Kind, TaskMeasures
from lerobot_excav.envs.tasks.scoop.spec import TASK_STATE_NAMES

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray


class DigRecord(EpisodeRecord):
    """Outcome of digging, whatever the task."""

    soil: str  # soil preset
    density: str = "usual"  # of the soil; files of earlier releases do not say it
    pile: str = "heaps"  # shape of the pile; nor this
    fidelity: str  # numerical effort of the soil

    @property
    def soil_words(self) -> str:
        """What is dug, in words; that it is of the usual density, in heaps, goes without saying."""
        density = "" if self.density == "usual" else f"{self.density} "
        pile = "" if self.pile == "heaps" else f", {self.pile.replace('_', ' ')}"
        return f"{density}{self.soil}{pile}"


class ScoopRecord(DigRecord):
    """Outcome of one dig-load-dump cycle."""

    target_success: bool  # whether loading began inside the commanded patch
    retained_mass_kg: float  # soil brought into the box [kg]
    residual_bucket_mass_kg: float  # soil left in the bucket [kg]
    hard_target_contacts: NonNegativeInt  # hard contacts with the box
    spill_before_target_events: NonNegativeInt  # losses of soil on the way

    @property
    def has_hard_contact(self) -> bool:
        """Whether the box was hit hard."""
        return self.hard_target_contacts > 0

    @property
    def has_spill(self) -> bool:
        """Whether soil was lost on the way."""
        return self.spill_before_target_events > 0

    @property
    @override
    def outcome_words(self) -> str:
        """Where was dug, and how much came of it."""
        mass_kg = round(self.retained_mass_kg)
        where = "dug in the region" if self.target_success else "dug elsewhere"
        return f"{where}, {mass_kg} kg" if mass_kg else "brought nothing"


def scoop_outcome(task_state: "NDArray[Any]") -> dict[str, Any]:
    """Return masses [kg] and events of an episode from its task states, (n, 8)."""
    last = dict(zip(TASK_STATE_NAMES, task_state[-1].tolist(), strict=True))
    deposited = task_state[:, TASK_STATE_NAMES.index("deposited_mass_kg")]
    return {
        "retained_mass_kg": float(deposited[-1] - deposited[0]),
        "residual_bucket_mass_kg": last["bucket_mass_kg"],
        "excavated_mass_kg": last["excavated_mass_kg"],
        "hard_target_contacts": round(last["hard_target_contacts"]),
        "spill_before_target_events": round(last["spill_before_target_events"]),
    }


def scoop_summary(index: "pd.DataFrame") -> str:
    """Describe the outcomes of an index."""
    return f"retained mass: {index['retained_mass_kg'].mean():.0f} kg on average"


def _legend(operator: str | None) -> list[str]:
    if operator is None:
        return []
    return [f"Efficiency: retained mass over the operator's on the same scenes and targets; operator: {operator}."]


SCOOP_MEASURES = TaskMeasures(
    record=ScoopRecord,
    settings={"soil": "soils", "density": "densities", "pile": "shapes of piles", "fidelity": "fidelities"},
    shared={"changes": "times at which the command changes"},
    setting={"soil": "soil_words", "mask": "mask"},
    columns=(
        Column(key="target_success", header="target success [%]", kind=Kind.RATE, field="target_success"),
        Column(key="full_success", header="full success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="retained_mass_kg", header="retained [kg]", kind=Kind.MEAN, field="retained_mass_kg"),
        Column(key="efficiency", header="efficiency [%]", kind=Kind.RATIO, field="retained_mass_kg"),
        Column(key="residual_bucket_mass_kg", header="residual [kg]", kind=Kind.MEAN, field="residual_bucket_mass_kg"),
        Column(key="hard_contact", header="hard contact [%]", kind=Kind.RATE, field="has_hard_contact"),
        Column(key="spill", header="spill [%]", kind=Kind.RATE, field="has_spill"),
    ),
    compared=("target_success", "full_success", "retained_mass_kg"),
    world="dug {soil} at {fidelity} fidelity in version {simulation_version} of the simulation, {pile} of {density} "
    "density",
    simulation="version {simulation_version}, {fidelity} fidelity of the soil",
    legend=_legend,
    outcome=scoop_outcome,
    summary=scoop_summary,
)
