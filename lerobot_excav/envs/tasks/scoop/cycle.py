"""One dig-load-dump cycle: its measurements, its outcome and when that outcome is final."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import distance_to_box_footprint_m
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.scoop.carry import CarryWatch
from lerobot_excav.envs.tasks.scoop.scene import Scene
from lerobot_excav.envs.tasks.scoop.spec import TaskState
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.envs.tasks.scoop.task_state import TaskMeter

LOADING_ONSET_KG = 20.0
"""Payload at which a bucket counts as loading, and below which it counts as emptied [kg]."""

LEAST_RETAINED_KG = 100.0
"""Retained mass of an effective scoop [kg] (paper's code family)."""

SETTLING_TICKS = 25
"""How long the bucket stays empty before the outcome is final: 0.5 s (paper's code family)."""


class DigCycle:
    """Follows one cycle on one target.

    Args:
        worksite: Where the machine works; the cycle starts at its present state.
        scene: The scene it was reset to.
        target_id: Index of the commanded dig region in `scene.targets`.

    Attributes:
        target_hit: Whether loading began inside the commanded region; None before.
        onset_time_s: When it began, since the start of the cycle [s].
        onset_w: Where: middle of the cutting edge (3,) [m], world frame.
    """

    def __init__(self, worksite: Worksite, scene: Scene, target_id: int) -> None:
        self._worksite = worksite
        self._meter = TaskMeter(worksite, scene.targets[target_id])
        self._empty_ticks = 0
        self._ticks = 0
        self.scene = scene
        self.target_id = target_id
        # A load that was left in the bucket by the cycle before is not loaded now.
        self._was_empty = worksite.soil.payload_mass_kg <= LOADING_ONSET_KG
        self.target_hit: bool | None = None
        self.onset_time_s: float | None = None
        self.onset_w: NDArray[np.float64] | None = None

    @property
    def target(self) -> Target:
        """The commanded dig region."""
        return self.scene.targets[self.target_id]

    def retarget(self, target_id: int) -> None:
        """Command another dig region from now on; a region that was hit before counts no more."""
        self.target_id = target_id
        self.target_hit = self.onset_time_s = self.onset_w = None
        self._was_empty = self._worksite.soil.payload_mass_kg <= LOADING_ONSET_KG  # what is carried is not loaded there
        self._meter.retarget(self.target)

    @property
    def carry(self) -> CarryWatch:
        """The way of the present load to the box."""
        return self._meter.carry

    @property
    def state(self) -> TaskState:
        """Running measurements."""
        return self._meter.state

    def update(self) -> None:
        """Take in the tick that has just passed."""
        self._ticks += 1
        state = self._meter.update()
        is_loaded = state.bucket_mass_kg > LOADING_ONSET_KG
        self._was_empty |= not is_loaded
        if self.target_hit is None and self._was_empty and is_loaded:
            self.onset_w = np.array(self._worksite.machine.cutting_edge_pos_w)
            self.target_hit = bool(self.target.contains(self.onset_w))
            self.onset_time_s = self._ticks * TICK_S
        settled = self.is_emptied and not self._soil_moves_over_box()
        self._empty_ticks = self._empty_ticks + 1 if settled else 0

    def _soil_moves_over_box(self) -> bool:
        """Tell whether loose soil above or in the box has yet to come to rest; elsewhere it can move as it likes."""
        soil = self._worksite.soil
        loose_w = soil.parcel_positions_w[~soil.parcel_is_load]
        return bool((distance_to_box_footprint_m(loose_w) == 0.0).any())

    @property
    def is_emptied(self) -> bool:
        """Whether soil has been brought to the box and the bucket is empty; how much there is may still change."""
        state = self._meter.state
        return state.deposited_mass_kg >= LOADING_ONSET_KG and state.bucket_mass_kg < LOADING_ONSET_KG

    @property
    def is_complete(self) -> bool:
        """Whether soil has been brought to the box and the bucket has stayed empty since; final."""
        return self._empty_ticks >= SETTLING_TICKS

    @property
    def is_success(self) -> bool:
        """Whether the cycle is complete and dug where it was told, brought enough, and hit nothing hard."""
        return (
            self.is_complete
            and self.target_hit is True
            and self.state.deposited_mass_kg >= LEAST_RETAINED_KG
            and self.state.hard_target_contacts == 0
        )

    @property
    def failure(self) -> str | None:
        """What has gone wrong for good, in words; None as long as the cycle can succeed, or has."""
        if self.target_hit is False:
            return "missed region"
        if self.state.hard_target_contacts > 0:
            return "hit the box"
        if self.is_complete and self.state.deposited_mass_kg < LEAST_RETAINED_KG:
            return "too little soil"
        return None

    def metrics(self) -> dict[str, Any]:
        """Return the outcome part by part, as it goes into the metrics file."""
        return {
            "target_success": self.target_hit is True,
            "retained_mass_kg": self.state.deposited_mass_kg,
            "residual_bucket_mass_kg": self.state.bucket_mass_kg,
            "excavated_mass_kg": self.state.excavated_mass_kg,
            "hard_target_contacts": self.state.hard_target_contacts,
            "spill_before_target_events": self.state.spill_before_target_events,
            # Not a number: never loaded. Vector environments cannot carry None; the metrics file says null.
            "loading_onset_time_s": math.nan if self.onset_time_s is None else self.onset_time_s,
            "cycle_complete": self.is_complete,
            "duration_s": self._ticks * TICK_S,
        }
