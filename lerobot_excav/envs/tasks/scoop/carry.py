"""The way of a load from the pile to the box, and what is spilled on it."""

import numpy as np

from lerobot_excav.envs.machines.excavator.layout import distance_to_box_footprint_m
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import Tool

SPILL_LEAST_PAYLOAD_KG = 50.0
"""Payload from which on a bucket is loaded (source: xtt001/excavator_testbed, the public code nearest to the paper)."""

LIFTED_CLEARANCE_M = 0.3
"""Height of the lowest point of the bucket over the soil from which on it is lifted [m].

Below, the heap on the bucket sheds what does not rest on it: 77 to 118 kg after five of eight full cuts (kind: tuned on
cycles of the scripted operator in `train` scenes).
"""

SPILL_LEAST_LOSS_KG = 20.0
SPILL_LEAST_SHARE = 0.1
"""Least loss of a spill [kg], and least share of what was lifted.

A lifted load that is carried well trickles: 0 to 26 of 387 to 500 kg in those cycles (kind: tuned).
"""


class CarryWatch:
    """Follows a load from where it is lifted to the box, and tells when it is spilled.

    The way begins when a bucket with at least `SPILL_LEAST_PAYLOAD_KG` is lifted by `LIFTED_CLEARANCE_M`, and ends when
    the cutting edge is over the box, or the bucket touches the soil again. Every way counts one spill at most.

    Attributes:
        lifted_kg: Payload when it was lifted [kg]; None between two ways.
        lost_kg: What it has lost since [kg].
    """

    def __init__(self, worksite: Worksite) -> None:
        self._worksite = worksite
        self._is_spilled = False
        self.lifted_kg: float | None = None
        self.lost_kg = 0.0

    def update(self, payload_kg: float) -> bool:
        """Take in the tick that has just passed, with the payload after it; return whether soil was spilled in it."""
        if self.lifted_kg is None and payload_kg < SPILL_LEAST_PAYLOAD_KG:
            return False
        machine = self._worksite.machine
        clearance_m = bucket_clearance_m(self._worksite, machine.tool())
        is_over_box = bool(distance_to_box_footprint_m(machine.cutting_edge_pos_w) == 0.0)
        if self.lifted_kg is None:
            if clearance_m >= LIFTED_CLEARANCE_M and not is_over_box:
                self.lifted_kg, self.lost_kg, self._is_spilled = payload_kg, 0.0, False
            return False
        if is_over_box or clearance_m <= 0.0:
            self.lifted_kg = None
            return False
        self.lost_kg = self.lifted_kg - payload_kg
        is_spill = self.lost_kg >= max(SPILL_LEAST_LOSS_KG, SPILL_LEAST_SHARE * self.lifted_kg)
        is_new = is_spill and not self._is_spilled
        self._is_spilled |= is_spill
        return is_new


def bucket_clearance_m(worksite: Worksite, tool: Tool) -> float:
    """Return how high the lowest point of a bucket's section is over the soil below it [m]; below 0 within the soil."""
    along, up = tool.geometry.profile_t.T
    section_t = np.stack([along, np.zeros_like(along), up], axis=-1)
    section_w = tool.position_w + section_t @ tool.rotation_w.T
    return float(np.min(section_w[:, 2] - worksite.soil.height_at(section_w[:, :2])))
