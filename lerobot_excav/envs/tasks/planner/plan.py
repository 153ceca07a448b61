"""The target planner: which regions are worth digging next, from what the main camera sees."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.tasks.planner.candidates import (
    LEAST_SEEN_SHARE,
    LEAST_SWEPT_M3,
    LONGEST_ONSET_M,
    Candidates,
    find_candidates,
)
from lerobot_excav.envs.tasks.planner.surface import SeenSurface
from lerobot_excav.envs.tasks.planner.zones import Zone
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M, Target
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE

_REASONS = ("swept_m3", "onset_m", "radius_m", "seen_share", "vain_tries", "score")


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """A region that is worth digging, and why.

    Attributes:
        target: The region.
        swept_m3: Soil within the cut [m3].
        onset_m: Length of the cut after which loading begins [m].
        radius_m: Distance from the swing axis [m].
        seen_share: Part of the cut that is seen.
        vain_tries: Number of cycles here that brought nothing.
        score: How good it is among all places [m3].
    """

    target: Target
    swept_m3: float
    onset_m: float
    radius_m: float
    seen_share: float
    vain_tries: float
    score: float

    @property
    def reason(self) -> dict[str, float]:
        """What speaks for it, rounded, as it goes into files."""
        return {name: round(float(getattr(self, name)), 4) for name in _REASONS}


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What the planner makes of a surface.

    Attributes:
        proposals: Regions apart from each other, the best first; at most `TARGETS_PER_SCENE`.
        candidates: All places that were thought of.
        nothing_left: Why there is no proposal, in words; None if there is one.
    """

    proposals: tuple[Proposal, ...]
    candidates: Candidates
    nothing_left: str | None

    @property
    def targets(self) -> tuple[Target, ...]:
        """The regions of the proposals."""
        return tuple(proposal.target for proposal in self.proposals)


def plan_targets(
    surface: SeenSurface, keep_out: Sequence[Zone] = (), vain_w: Sequence[NDArray[np.float64]] = ()
) -> Plan:
    """Choose the regions with the most soil within a cut; the same arguments give the same plan.

    The best possible place comes first, then the best of those that lie apart from all before, and so on. Zones of
    `keep_out` bar the regions that they touch, and those whose cut path they do. `vain_w` are the centres (3,) [m] of
    regions on which cycles brought nothing: regions that overlap them come after all others, the least tried first.
    """
    candidates = find_candidates(surface, keep_out, vain_w)
    free, chosen = candidates.is_possible.copy(), list[int]()
    while free.any() and len(chosen) < TARGETS_PER_SCENE:
        best = int(np.argmax(np.where(free, candidates.score, -np.inf)))
        chosen.append(best)
        away_m = np.hypot(*(candidates.centers_w[:, :2] - candidates.centers_w[best, :2]).T)
        free &= away_m >= LEAST_DISTANCE_M
    proposals = tuple(proposal_of(candidates, index) for index in chosen)
    return Plan(proposals=proposals, candidates=candidates, nothing_left=None if chosen else _why_none(candidates))


def proposal_of(candidates: Candidates, index: int) -> Proposal:
    """Return one of the candidates as a proposal, with what speaks for it."""
    center_w = candidates.centers_w[index].copy()
    reasons = {name: float(getattr(candidates, name)[index]) for name in _REASONS}
    return Proposal(target=Target(center_w=center_w, yaw_rad=cylinder_from_world(center_w)[1]), **reasons)


def _why_none(candidates: Candidates) -> str:
    """Say of all places within reach what keeps them from being dug, each with its first reason."""
    hidden = candidates.seen_share < LEAST_SEEN_SHARE
    thin = ~candidates.is_barred & ~hidden & (candidates.swept_m3 < LEAST_SWEPT_M3)
    late = ~candidates.is_barred & ~hidden & ~thin & (candidates.onset_m > LONGEST_ONSET_M)
    return (
        f"of {candidates.score.size} places within reach {candidates.is_barred.sum()} are barred by keep_out, "
        f"{(hidden & ~candidates.is_barred).sum()} hidden, {thin.sum()} have less than {LEAST_SWEPT_M3} m3 within a "
        f"cut, and at {late.sum()} loading would begin beyond the region"
    )
