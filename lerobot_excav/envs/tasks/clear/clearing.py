"""The course of an episode of Clear-v0: its cycles, its events, and how much of the pile is gone."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.clear.cycle_record import (
    DUMPED,
    SPILLED,
    TIMED_OUT,
    UNFINISHED,
    CycleRecord,
    commanded,
    failure_of,
    place,
)
from lerobot_excav.envs.tasks.clear.event_list import EventList
from lerobot_excav.envs.tasks.planner.plan import Proposal
from lerobot_excav.envs.tasks.scoop.cycle import LOADING_ONSET_KG, SETTLING_TICKS, DigCycle
from lerobot_excav.envs.tasks.scoop.missing_soil import missing_soil
from lerobot_excav.envs.tasks.scoop.spec import CYCLE_LIMIT_S

_HALF_DIG_AREA_M = 0.5 * np.array(DIG_AREA_EXTENT_M)


class Clearing:
    """Follows the cycles on one pile.

    Args:
        worksite: Where the machine works, freshly reset.

    Attributes:
        records: The cycles that are over.
        cycle: The running cycle, or the last one.
    """

    cycle: DigCycle

    def __init__(self, worksite: Worksite) -> None:
        self._worksite = worksite
        self._events = EventList()
        self._pile_kg = self.left_kg
        self.records: list[CycleRecord] = []

    def begin(self, cycle: DigCycle, proposal: Proposal) -> None:
        """Begin a cycle on a region that the planner has proposed."""
        self.cycle, self._proposal, self._is_running = cycle, proposal, True
        self._began_s, self._lost_ticks = self._events.time_s, 0
        self._heights_m = self._worksite.soil.heights_m.copy()
        self._exit_w: Any = None
        self._events.begin_cycle()

    def recommand(self, target_id: int, proposal: Proposal) -> None:
        """Command another of the proposed regions within the cycle."""
        self._proposal = proposal
        self.cycle.retarget(target_id)

    def begin_time_again(self) -> None:
        """Give the running cycle its whole time again, unless it has loaded something."""
        if self.cycle.onset_time_s is None:
            self._began_s = self._events.time_s

    def update(self) -> None:
        """Take in the tick that has just passed."""
        self.cycle.update()
        state = self.cycle.state
        self._events.update(len(self.records), self.cycle)
        if self.cycle.carry.lifted_kg is not None and self._exit_w is None:
            self._exit_w = self._worksite.machine.cutting_edge_pos_w.copy()
        is_lost = (
            state.spill_before_target_events > 0
            and max(state.bucket_mass_kg, state.deposited_mass_kg) < LOADING_ONSET_KG
        )
        self._lost_ticks = self._lost_ticks + 1 if is_lost else 0

    @property
    def is_dumped(self) -> bool:
        """Whether the running cycle has emptied its bucket into the box; it ends when the soil has come to rest."""
        # Soil of the cycle before may still fall into the box; that is no dump of this one.
        return self.cycle.onset_time_s is not None and self.cycle.is_emptied

    @property
    def end(self) -> str | None:
        """How the running cycle has ended, or None if it has not."""
        if self.cycle.is_complete and self.is_dumped:
            return DUMPED
        if self._lost_ticks >= SETTLING_TICKS:
            return SPILLED
        return TIMED_OUT if self._cycle_s >= CYCLE_LIMIT_S - 0.5 * TICK_S else None

    def finish(self, end: str) -> None:
        """Put the running cycle down as ended."""
        number, state = len(self.records), self.cycle.state
        if end != SPILLED:  # the spill itself is in the list
            mass_kg = state.deposited_mass_kg if end == DUMPED else state.bucket_mass_kg
            self._events.add(end, number, self.cycle, mass_kg)
        self.records.append(self._record(end))
        self._is_running = False

    @property
    def vain_w(self) -> list[NDArray[np.float64]]:
        """Centres (3,) [m] of the regions whose cycles have brought nothing, so that others are tried first."""
        return [np.array(record.region_w) for record in self.records if record.retained_mass_kg < LOADING_ONSET_KG]

    @property
    def left_kg(self) -> float:
        """Soil in the dig area, on the ground and in the air, without that in the bucket [kg]."""
        soil = self._worksite.soil
        inside = (np.abs(soil.parcel_positions_w[:, :2]) <= _HALF_DIG_AREA_M).all(axis=1) & ~soil.parcel_is_load
        return float(soil.ledger_kg()["grid"] + soil.parcel_masses_kg[inside].sum())

    @property
    def pile_removed(self) -> float:
        """Part of the pile that is gone from the dig area."""
        return 1.0 - self.left_kg / self._pile_kg

    @property
    def hard_target_contacts(self) -> int:
        """Hard contacts with the box, in all cycles."""
        running = self.cycle.state.hard_target_contacts if self._is_running else 0
        return running + sum(record.hard_target_contacts for record in self.records)

    def all_records(self) -> list[CycleRecord]:
        """Return the cycles, the running one as it would be if it ended now."""
        return [*self.records, self._record(UNFINISHED)] if self._is_running else self.records

    @property
    def events(self) -> list[dict[str, Any]]:
        """The events so far."""
        return list(self._events.events)

    @property
    def _cycle_s(self) -> float:
        return self._events.time_s - self._began_s

    def _record(self, end: str) -> CycleRecord:
        cycle, state, soil = self.cycle, self.cycle.state, self._worksite.soil
        source_w, depth_m = missing_soil(self._heights_m, soil.heights_m, soil.x_w, soil.y_w)
        return CycleRecord(
            cycle=len(self.records),
            began_s=round(self._began_s, 2),
            duration_s=round(self._cycle_s, 2),
            end=end,
            **commanded(self._proposal, cycle.target_id),
            target_success=cycle.target_hit is True,
            onset_w=place(cycle.onset_w),
            source_w=None if source_w is None else place(np.array(source_w)),
            depth_m=None if depth_m is None else round(depth_m, 3),
            exit_w=place(self._exit_w),
            retained_mass_kg=round(state.deposited_mass_kg, 2),
            residual_bucket_mass_kg=round(state.bucket_mass_kg, 2),
            hard_target_contacts=state.hard_target_contacts,
            spill_before_target_events=state.spill_before_target_events,
            pile_removed=round(self.pile_removed, 5),
            failure=failure_of(cycle, end, self.records[-1] if self.records else None),
        )
