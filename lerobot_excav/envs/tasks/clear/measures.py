"""What is measured of Clear-v0; `docs/reference/metrics.md` defines the measures."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, override

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, NonNegativeInt

from lerobot_excav.envs.tasks.clear.cycle_record import DUMPED, ENDS, FAILURES, NO_FAILURE, TIMED_OUT
from lerobot_excav.envs.tasks.clear.event_list import EVENTS
from lerobot_excav.envs.tasks.measures import Column, Kind, TargetId, TaskMeasures, one_of
from lerobot_excav.envs.tasks.scoop.measures import DigRecord
from lerobot_excav.envs.tasks.scoop.settings import BETWEEN_CYCLES
from lerobot_excav.envs.tasks.scoop.spec import TASK_STATE_NAMES

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

Point = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]
"""A place [m], world frame."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)


class ClearCycle(_Part):
    """One cycle; `cycle_record.CycleRecord` says what each field is."""

    cycle: NonNegativeInt
    began_s: NonNegativeFloat
    duration_s: NonNegativeFloat
    end: Annotated[str, one_of(ENDS)]
    target_id: TargetId
    region_w: Point
    target_success: bool
    onset_w: Point | None
    source_w: Point | None
    depth_m: float | None
    exit_w: Point | None
    retained_mass_kg: float
    residual_bucket_mass_kg: float
    hard_target_contacts: NonNegativeInt
    spill_before_target_events: NonNegativeInt
    pile_removed: float
    failure: Annotated[str, one_of((*FAILURES, NO_FAILURE))]


class ClearEvent(_Part):
    """One event; `event_list.EventList` says what each field is."""

    event: Annotated[str, one_of(tuple(dict.fromkeys((*EVENTS, *ENDS))))]
    time_s: NonNegativeFloat
    cycle: NonNegativeInt
    region_w: Point
    mass_kg: float


class ClearRecord(DigRecord):
    """Outcome of one pile."""

    keep_out: str  # zones in which nothing may be dug
    between_cycles: Annotated[str, one_of(BETWEEN_CYCLES)] = "obey"  # files of earlier releases do not say it
    pile_removed: float = Field(le=1.0)  # part of the pile that is gone from the dig area
    retained_mass_kg: float  # soil brought into the box, in all cycles [kg]
    hard_target_contacts: NonNegativeInt  # hard contacts with the box
    spill_before_target_events: NonNegativeInt  # losses of soil on the way
    cycles: tuple[ClearCycle, ...]  # one by one, the last perhaps unfinished
    events: tuple[ClearEvent, ...]  # what happened when

    @property
    @override
    def mask(self) -> str:
        """What the mask showed, in words; that it changes with every cycle goes without saying."""
        return self.mask_words if self.between_cycles == "obey" else f"{self.mask_words}, standing when it changes"

    @property
    def cycle_count(self) -> int:
        """How many cycles there were."""
        return len(self.cycles)

    @property
    def pile_removed_percent(self) -> float:
        """Part of the pile that is removed [%]."""
        return 100.0 * self.pile_removed

    @property
    @override
    def outcome_words(self) -> str:
        """Share of the pile that is gone."""
        return f"{round(self.pile_removed_percent)} % removed"

    @property
    def target_success_percent(self) -> float:
        """Part of the cycles in which loading began inside the commanded region [%]."""
        return self._percent(cycle.target_success for cycle in self.cycles)

    @property
    def complete_percent(self) -> float:
        """Part of the cycles that ended with a dump [%]."""
        return self._percent(cycle.end == DUMPED for cycle in self.cycles)

    @property
    def timed_out_percent(self) -> float:
        """Part of the cycles whose time was over [%]."""
        return self._percent(cycle.end == TIMED_OUT for cycle in self.cycles)

    @property
    def spill_percent(self) -> float:
        """Part of the cycles in which soil was spilled on the way [%]."""
        return self._percent(cycle.spill_before_target_events > 0 for cycle in self.cycles)

    @property
    def mass_per_cycle_kg(self) -> float:
        """Soil brought into the box, per cycle [kg]."""
        return self.retained_mass_kg / max(self.cycle_count, 1)

    @property
    def has_hard_contact(self) -> bool:
        """Whether the box was hit hard."""
        return self.hard_target_contacts > 0

    @property
    def commonest_failure(self) -> str:
        """What went wrong in most cycles that failed, the first of equals; `none` if none did."""
        counts = Counter(cycle.failure for cycle in self.cycles)
        worst = max(FAILURES, key=lambda failure: counts[failure])
        return worst if counts[worst] else NO_FAILURE

    def _percent(self, are_so: Iterable[bool]) -> float:
        return 100.0 * sum(are_so) / max(self.cycle_count, 1)


def clear_outcome(task_state: "NDArray[Any]") -> dict[str, Any]:
    """Return masses [kg] and events of an episode from its task states, (n, 8), whose counts every cycle resets."""
    names = ("deposited_mass_kg", "excavated_mass_kg", "hard_target_contacts", "spill_before_target_events")
    columns = task_state[:, [TASK_STATE_NAMES.index(name) for name in names]]
    # Within a cycle none of these falls, but for a few grains that leave the box again.
    ends = np.flatnonzero((np.diff(columns[:, 1:], axis=0) < 0.0).any(axis=1))
    sums = columns[[*ends, len(columns) - 1]].sum(axis=0)
    return {
        "retained_mass_kg": float(sums[0]),
        "residual_bucket_mass_kg": float(task_state[-1, TASK_STATE_NAMES.index("bucket_mass_kg")]),
        "excavated_mass_kg": float(sums[1]),
        "hard_target_contacts": round(float(sums[2])),
        "spill_before_target_events": round(float(sums[3])),
    }


def clear_summary(index: "pd.DataFrame") -> str:
    """Describe the outcomes of an index."""
    return f"retained mass: {index['retained_mass_kg'].mean():.0f} kg per pile on average"


def clear_sentence(piles: Sequence[ClearRecord]) -> str:
    """Say in one sentence what was cleared and where digging began."""
    cycles = [cycle for pile in piles for cycle in pile.cycles]
    hits, count = sum(cycle.target_success for cycle in cycles), len(piles)
    removed = 100.0 * float(np.mean([pile.pile_removed for pile in piles]))
    number = f"{len(cycles) / max(count, 1):.0f} cycles"
    what = f"{removed:.0f} % of the pile was removed in {number}"
    if count != 1:
        what = f"Of {count} piles {removed:.0f} % was removed on average, in {number} each"
    masks = {pile.shown_words for pile in piles}
    contacts = sum(pile.hard_target_contacts for pile in piles)
    hit_hard = {0: "never hit hard", 1: "hit hard once"}.get(contacts, f"hit hard {contacts} times")
    return (
        f"{what}; in {hits} of {len(cycles)} cycles digging began inside the commanded region; the box was {hit_hard}."
        f"{'' if masks == {'correct'} else f' The mask: {"; ".join(sorted(masks))}.'}"
    )


def _legend(operator: str | None) -> list[str]:
    lines = [
        "Shares of cycles are averaged over piles, each with the same weight.",
        f"Commonest failure: piles with {' / '.join((*FAILURES, NO_FAILURE))}.",
    ]
    if operator is None:
        return lines
    return [*lines, f"Efficiency: pile removed over the operator's on the same scenes; operator: {operator}."]


PERCENT = (0.0, 100.0)
"""Bounds of shares in percent."""

CLEAR_MEASURES = TaskMeasures(
    record=ClearRecord,
    settings={
        "soil": "soils",
        "density": "densities",
        "pile": "shapes of piles",
        "fidelity": "fidelities",
        "keep_out": "keep-out zones",
        "between_cycles": "ways to wait for a command",
    },
    shared={},
    setting={"soil": "soil_words", "mask": "mask"},
    columns=(
        Column(
            key="pile_removed", header="pile removed [%]", kind=Kind.MEAN, field="pile_removed_percent", bounds=PERCENT
        ),
        Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="efficiency", header="efficiency [%]", kind=Kind.RATIO, field="pile_removed"),
        Column(key="cycles", header="cycles", kind=Kind.MEAN, field="cycle_count"),
        Column(key="mass_per_cycle_kg", header="retained a cycle [kg]", kind=Kind.MEAN, field="mass_per_cycle_kg"),
        Column(
            key="target_success",
            header="target success [% of cycles]",
            kind=Kind.MEAN,
            field="target_success_percent",
            bounds=PERCENT,
        ),
        Column(key="complete", header="dumped [% of cycles]", kind=Kind.MEAN, field="complete_percent", bounds=PERCENT),
        Column(
            key="timed_out", header="timed out [% of cycles]", kind=Kind.MEAN, field="timed_out_percent", bounds=PERCENT
        ),
        Column(key="spill", header="spill [% of cycles]", kind=Kind.MEAN, field="spill_percent", bounds=PERCENT),
        Column(key="hard_contact", header="hard contact [%]", kind=Kind.RATE, field="has_hard_contact"),
        Column(
            key="commonest_failure",
            header="commonest failure",
            kind=Kind.COUNTS,
            field="commonest_failure",
            words=(*FAILURES, NO_FAILURE),
        ),
    ),
    compared=("pile_removed", "success"),
    world="dug {soil} at {fidelity} fidelity within {episode_length} frames, with keep-out zones {keep_out!r}, in "
    "version {simulation_version} of the simulation, {pile} of {density} density",
    simulation="version {simulation_version}, {fidelity} fidelity of the soil",
    legend=_legend,
    outcome=clear_outcome,
    summary=clear_summary,
    sentence=clear_sentence,
    figure_entry="lerobot_excav.envs.tasks.clear.cut_map:draw_cut_map",
    method_figures={
        "pile removed over cycles": "lerobot_excav.envs.tasks.clear.method_figures:draw_progress",
        "what came of the cycles": "lerobot_excav.envs.tasks.clear.method_figures:draw_failures",
        "how far from their regions cycles begin": "lerobot_excav.envs.tasks.clear.entry_figure:draw_entries",
        "where each dug on the same pile": "lerobot_excav.envs.tasks.clear.method_figures:draw_same_pile",
    },
)
