"""Task state: what is measured at every tick to judge a cycle. Never an input of a policy."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX, distance_to_box_footprint_m
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import Tool, ToolGeometry
from lerobot_excav.envs.tasks.scoop.carry import CarryWatch
from lerobot_excav.envs.tasks.scoop.spec import TaskState
from lerobot_excav.envs.tasks.scoop.targets import Target

# Threshold of a hard contact (source: xtt001/excavator_testbed, the public code nearest to the paper; kind: paper).
HARD_CONTACT_FORCE_N = 5000.0
FOOTPRINT_FADE_M = 0.25

_HALF_DIG_AREA_M = 0.5 * np.array(DIG_AREA_EXTENT_M)


class TaskMeter:
    """Keeps the task state up to date, tick by tick.

    Args:
        worksite: Where the machine works, as it is at the start of the cycle.
        target: The commanded dig region.
    """

    def __init__(self, worksite: Worksite, target: Target) -> None:
        self._worksite = worksite
        self._target = target
        self._box_mass_start_kg = worksite.soil.box_mass_kg
        # A cycle may begin with what the one before has left: a load, or a contact that lasts.
        self._in_hard_contact = worksite.machine.box_contact_force_n >= HARD_CONTACT_FORCE_N
        self.carry = CarryWatch(worksite)
        self.state = TaskState(bucket_mass_kg=worksite.soil.payload_mass_kg)
        self._measure_places()

    def retarget(self, target: Target) -> None:
        """Measure the distance to another dig region from now on."""
        self._target = target
        self._measure_places()

    def update(self) -> TaskState:
        """Take in the tick that has just passed and return the state."""
        state = self.state
        previous_bucket_kg = state.bucket_mass_kg
        state.bucket_mass_kg = self._worksite.soil.payload_mass_kg
        state.deposited_mass_kg = max(0.0, self._worksite.soil.box_mass_kg - self._box_mass_start_kg)
        # Soil that leaves the bucket and enters it again counts twice, as in the definition this follows.
        state.excavated_mass_kg += max(0.0, state.bucket_mass_kg - previous_bucket_kg)
        state.spill_before_target_events += int(self.carry.update(state.bucket_mass_kg))
        self._count_hard_contact()
        self._measure_places()
        return state

    def _count_hard_contact(self) -> None:
        """Count one contact per episode of touching, at the moment it becomes hard."""
        force_n = self._worksite.machine.box_contact_force_n
        if force_n >= HARD_CONTACT_FORCE_N and not self._in_hard_contact:
            self._in_hard_contact = True
            self.state.hard_target_contacts += 1
        elif force_n == 0.0:
            self._in_hard_contact = False

    def _measure_places(self) -> None:
        edge_w = self._worksite.machine.cutting_edge_pos_w
        way_w = edge_w - self._target.center_w
        self.state.distance_to_target_m = math.sqrt(way_w.dot(way_w))
        self.state.distance_to_box_m = distance_to_box_m(edge_w)
        self.state.bucket_depth_below_dig_plane_m = depth_below_dig_plane_m(self._worksite.machine.tool())


def distance_to_box_m(point_w: NDArray[np.float64]) -> float:
    """Return the distance from a point to the box with its walls [m]; zero inside or above-floor within the walls."""
    above = max(0.0, point_w[2] - TARGET_BOX.center_w[2] - TARGET_BOX.wall_height_m)
    return float(np.hypot(distance_to_box_footprint_m(point_w), above))


def depth_below_dig_plane_m(tool: Tool) -> float:
    """Return how far the bucket's bounding box reaches below the dig plane z = 0 inside the dig area [m].

    The greatest depth over a 5 x 5 x 5 sample of the box, faded out over `FOOTPRINT_FADE_M` to both sides of the edge
    of the dig area. The box and not the shell, as in the definition this follows: its corners reach deeper.
    """
    sample_t, reach_m = _box_samples(tool.geometry)
    if tool.position_w[2] > reach_m:
        return 0.0
    sample_w = tool.position_w + sample_t @ tool.rotation_w.T
    below_w = sample_w[sample_w[:, 2] < 0.0]
    if len(below_w) == 0:
        return 0.0
    inset = np.min(_HALF_DIG_AREA_M - np.abs(below_w[:, :2]), axis=1)
    return float(np.max(-below_w[:, 2] * _smoothstep(inset / FOOTPRINT_FADE_M)))


@lru_cache(maxsize=4)
def _box_samples(geometry: ToolGeometry) -> tuple[NDArray[np.float64], float]:
    """Return the sample of a bucket's bounding box, (125, 3) in its frame [m], and how far from its origin it goes."""
    low, high = geometry.profile_t.min(axis=0), geometry.profile_t.max(axis=0)
    half_width = 0.5 * geometry.inner_width_m
    axes = (np.linspace(low[0], high[0], 5), np.linspace(-half_width, half_width, 5), np.linspace(low[1], high[1], 5))
    sample_t = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return sample_t, float(np.linalg.norm(sample_t, axis=1).max())


def _smoothstep(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rise smoothly from 0 at -1 to 1 at +1."""
    t = np.clip(0.5 * (x + 1.0), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
