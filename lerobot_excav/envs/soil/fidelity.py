"""Levels of numerical effort."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical effort of one soil step."""

    vertical_bins: int  # samples along the height of a column inside the bucket
    substep_cells: float  # largest motion of the tool per sub-step, in cells
    force_slices: int  # lateral slices of the cutting edge in the force model
    parcel_radius_m: float  # radius of one parcel
    substeps_per_tick: int  # sub-steps of the parcels' motion per `TICK_S`
    most_awake: int  # bound on the number of parcels that move by themselves


FIDELITIES = {
    "fast": Fidelity(
        vertical_bins=2,
        substep_cells=1.0,
        force_slices=4,
        parcel_radius_m=0.06,
        substeps_per_tick=14,
        most_awake=500,
    ),
    "standard": Fidelity(
        vertical_bins=4,
        substep_cells=0.5,
        force_slices=8,
        parcel_radius_m=0.048,
        substeps_per_tick=16,
        most_awake=1000,
    ),
    "fine": Fidelity(
        vertical_bins=8,
        substep_cells=0.25,
        force_slices=12,
        parcel_radius_m=0.036,
        substeps_per_tick=30,
        most_awake=2000,
    ),
}
"""Known levels by name; all keep the same ledger and are deterministic."""
