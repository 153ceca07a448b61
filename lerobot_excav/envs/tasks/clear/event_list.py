"""What happened in an episode, with its time: read off the running cycle tick by tick."""

from typing import Any

from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.tasks.clear.cycle_record import place
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle

ONSET, FULL, SPILL, CONTACT = "onset", "full", "spill", "contact"
EVENTS = (ONSET, FULL, SPILL, CONTACT, "dump", "time-out")
"""Loading began; the bucket is full; soil was spilled on the way; the box was hit hard; how a cycle ended."""

FULL_KG = 400.0
"""Payload from which on a bucket counts as full [kg] (kind: guess; cycles of the scripted operator bring 435 kg)."""


class EventList:
    """Collects events; each is a dictionary of plain values, as it goes into the metrics file.

    `event` is one of `EVENTS`; `time_s` counts from the start of
    the episode; `region_w` is the centre of the commanded region; `mass_kg` is the payload, of a spill what was lost,
    and of a dump what the box has gained.
    """

    def __init__(self) -> None:
        self.events: list[dict[str, Any]] = []
        self._ticks = 0
        self._seen = {ONSET: 0, FULL: 0, SPILL: 0, CONTACT: 0}

    def begin_cycle(self) -> None:
        """Take note that another cycle begins, whose counts are zero."""
        self._seen = dict.fromkeys(self._seen, 0)

    @property
    def time_s(self) -> float:
        """Time since the start of the episode [s]."""
        return self._ticks * TICK_S

    def update(self, number: int, cycle: DigCycle) -> None:
        """Take in the tick that has just passed in a cycle."""
        self._ticks += 1
        state = cycle.state
        now = {
            ONSET: int(cycle.onset_time_s is not None),
            FULL: int(state.bucket_mass_kg >= FULL_KG or self._seen[FULL]),
            SPILL: state.spill_before_target_events,
            CONTACT: state.hard_target_contacts,
        }
        for name, count in now.items():
            if count > self._seen[name]:
                mass_kg = cycle.carry.lost_kg if name == SPILL else state.bucket_mass_kg
                self.add(name, number, cycle, mass_kg)
        self._seen = now

    def add(self, name: str, number: int, cycle: DigCycle, mass_kg: float) -> None:
        """Add an event of a cycle."""
        region_w = place(cycle.target.center_w)
        event = {"event": name, "time_s": round(self.time_s, 2), "cycle": number}
        self.events.append({**event, "region_w": region_w, "mass_kg": round(mass_kg, 1)})
