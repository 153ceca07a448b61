"""What is kept of a cycle of Clear-v0: what was commanded, and beside it what came of it."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.planner.plan import Proposal
from lerobot_excav.envs.tasks.scoop.cycle import LOADING_ONSET_KG, DigCycle

DUMPED, TIMED_OUT, SPILLED, UNFINISHED = ENDS = ("dump", "time-out", "spill", "unfinished")
"""How a cycle ends: the bucket is empty after the box got soil; its time was over; all of a lifted load was lost before
the box; the episode was over before the cycle."""

NO_FAILURE = "none"
NO_SOIL, HARD_CONTACT, SPILL = "no soil", "hard contact", "spill before target"
REPEATED, MISSED, INCOMPLETE_DUMP = "repeated default scoop", "missed region", "incomplete dump"
FAILURES = (NO_SOIL, HARD_CONTACT, SPILL, REPEATED, MISSED, INCOMPLETE_DUMP)
"""What can go wrong in a cycle; of several the first counts (categories: paper, but for `missed region`)."""

SAME_PLACE_M = 0.4
"""Half the edge of a region: nearer to each other two cuts begin at the same place [m] (kind: derived)."""


@dataclass(frozen=True, kw_only=True)
class CycleRecord:
    """One cycle that is over.

    Attributes:
        cycle: Its number, from 0.
        began_s: Time at which it was commanded, since the start of the episode [s].
        duration_s: How long it took [s].
        end: One of `ENDS`.
        target_id: Rank of the region among the planner's proposals.
        region_w: Centre of the commanded region (3,) [m], world frame.
        reason: What spoke for it, see `Proposal.reason`.
        target_success: Whether loading began inside the region.
        onset_w: Where loading began: cutting edge (3,) [m]; None if it did not, as with the next three.
        source_w: Where soil is missing after the cycle: centroid (2,) [m], weighted with the missing height.
        depth_m: How much lower the ground is where most of it is missing [m].
        exit_w: Where the bucket was lifted out of the soil: cutting edge (3,) [m].
        retained_mass_kg: Soil that the box gained [kg].
        residual_bucket_mass_kg: Soil left in the bucket [kg].
        hard_target_contacts: Hard contacts with the box.
        spill_before_target_events: Spills on the way.
        pile_removed: Part of the pile that is removed after it.
        failure: One of `FAILURES`, or `none`.
    """

    cycle: int
    began_s: float
    duration_s: float
    end: str
    target_id: int
    region_w: tuple[float, ...]
    reason: dict[str, float] = field(default_factory=dict)
    target_success: bool
    onset_w: tuple[float, ...] | None
    source_w: tuple[float, ...] | None
    depth_m: float | None
    exit_w: tuple[float, ...] | None
    retained_mass_kg: float
    residual_bucket_mass_kg: float
    hard_target_contacts: int
    spill_before_target_events: int
    pile_removed: float
    failure: str


def failure_of(cycle: DigCycle, end: str, last: CycleRecord | None) -> str:
    """Return what went wrong in a cycle, given the one before it."""
    state = cycle.state
    if cycle.onset_w is None:
        return NO_SOIL
    if state.hard_target_contacts > 0:
        return HARD_CONTACT
    if state.spill_before_target_events > 0 or end == SPILLED:
        return SPILL
    if cycle.target_hit is False:
        return REPEATED if _repeats(cycle, last) else MISSED
    if end != DUMPED or state.bucket_mass_kg >= LOADING_ONSET_KG:
        return INCOMPLETE_DUMP
    return NO_FAILURE


def _repeats(cycle: DigCycle, last: CycleRecord | None) -> bool:
    """Tell whether loading began where it did in the cycle before, though another place was commanded."""
    if last is None or last.onset_w is None or cycle.onset_w is None:
        return False
    same = math.dist(cycle.onset_w[:2], last.onset_w[:2]) < SAME_PLACE_M
    return same and math.dist(cycle.target.center_w[:2], last.region_w[:2]) >= SAME_PLACE_M


def place(point_w: NDArray[np.float64] | None) -> tuple[float, ...] | None:
    """Return a point as numbers for a file, to the millimetre."""
    return None if point_w is None else tuple(round(float(value), 3) for value in point_w)


def commanded(proposal: Proposal, target_id: int) -> dict[str, Any]:
    """Return the fields of a record that say what was commanded."""
    return {"target_id": target_id, "region_w": place(proposal.target.center_w), "reason": proposal.reason}
