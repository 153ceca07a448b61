"""Scoop-v0 in reports; `docs/datasets.md` defines the measures."""

from dataclasses import dataclass
from typing import Any

from lerobot_excav.envs.tasks.scoop.simulation_version import UNMARKED_VERSION
from lerobot_excav.evaluation.episode import Episode
from lerobot_excav.evaluation.task_table import Column, Kind, TaskTable


@dataclass(frozen=True, kw_only=True)
class ScoopEpisode(Episode):
    """Outcome of one dig-load-dump cycle.

    Attributes:
        soil: Soil preset.
        fidelity: Numerical effort of the soil.
        target_success: Whether loading began inside the commanded patch.
        retained_mass_kg: Soil brought into the box [kg].
        residual_bucket_mass_kg: Soil left in the bucket [kg].
        hard_target_contacts: Hard contacts with the box.
        spill_before_target_events: Losses of soil on the way.
    """

    soil: str
    fidelity: str
    target_success: bool
    retained_mass_kg: float
    residual_bucket_mass_kg: float
    hard_target_contacts: int
    spill_before_target_events: int

    @classmethod
    def completed(cls, record: dict[str, Any]) -> dict[str, Any]:
        """Add what earlier files do not hold: version and fidelity, of which there was one only, and noise, of none."""
        defaults = {"simulation_version": UNMARKED_VERSION, "mask_noise": "none", "mask_noise_px": 0}
        record = {**defaults, **record}
        if record["simulation_version"] == UNMARKED_VERSION:
            record.setdefault("fidelity", "standard")
        return record

    @property
    def has_hard_contact(self) -> bool:
        """Whether the box was hit hard."""
        return self.hard_target_contacts > 0

    @property
    def has_spill(self) -> bool:
        """Whether soil was lost on the way."""
        return self.spill_before_target_events > 0


def _legend(operator: str | None) -> list[str]:
    if operator is None:
        return []
    return [
        f"Efficiency: retained mass over the operator's on the same scenes and targets; operator: {operator}."
    ]


SCOOP = TaskTable(
    task="Scoop-v0",
    episode=ScoopEpisode,
    constants={
        "mask_condition": "mask conditions",
        "mask_noise": "kinds of mask noise",
        "mask_noise_px": "strengths of mask noise",
        "soil": "soils",
        "fidelity": "fidelities",
        "simulation_version": "versions of the simulation",
    },
    setting={"soil": "soil", "mask": "mask"},
    columns=(
        Column(key="target_success", header="target success [%]", kind=Kind.RATE, field="target_success"),
        Column(key="full_success", header="full success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="retained_mass_kg", header="retained [kg]", kind=Kind.MEAN, field="retained_mass_kg"),
        Column(key="efficiency", header="efficiency [%]", kind=Kind.RATIO, field="retained_mass_kg"),
        Column(
            key="residual_bucket_mass_kg",
            header="residual [kg]",
            kind=Kind.MEAN,
            field="residual_bucket_mass_kg",
        ),
        Column(key="hard_contact", header="hard contact [%]", kind=Kind.RATE, field="has_hard_contact"),
        Column(key="spill", header="spill [%]", kind=Kind.RATE, field="has_spill"),
    ),
    compared=("target_success", "full_success", "retained_mass_kg"),
    world="dug {soil} in version {simulation_version} of the simulation",
    simulation="version {simulation_version}, {fidelity} fidelity of the soil",
    legend=_legend,
)
