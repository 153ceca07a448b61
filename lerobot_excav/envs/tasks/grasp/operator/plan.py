"""The way of the gripper through one grasp: way-points in space and time, and the smooth path between them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.tasks.grasp.operator.variation import Variation

# Heights of the grasp point above the table [m] (published way-points, raised by half a block where they name the
# block's centre; kind: paper), except the grip: pads of 45 mm around a block of 40 mm must stay off the table.
APPROACH_HEIGHT_M = 0.10
GRIP_HEIGHT_M = 0.028
LIFT_HEIGHT_M = 0.14
TRAY_HEIGHT_M = 0.12
RELEASE_HEIGHT_M = 0.055

# Openings of the gripper: wide enough to clear a block by 17 mm on either side, narrow enough to miss its neighbours.
OPEN, CLOSED = 0.62, 0.0

# Nominal durations of the phases [s] (kind: tuned; the published ones, with a shorter carry and a slower way back, on
# which the arm would otherwise run at its speed limit).
PHASE_DURATION_S = {
    "approach": 1.2,
    "descend": 0.5,
    "grip": 0.4,
    "lift": 0.5,
    "carry": 2.2,
    "lower": 0.4,
    "release": 0.3,
    "leave": 0.3,
    "return": 1.6,
}
PHASES = tuple(PHASE_DURATION_S)


class WayPoint(NamedTuple):
    """Where the grasp point is at the end of a phase [m], world frame, and the gripper's target during it."""

    time_s: float
    pos_w: NDArray[np.float64]
    opening: float


class Command(NamedTuple):
    """What a plan asks for at a moment."""

    grasp_pos_w: NDArray[np.float64]  # position of the grasp point [m], (3,), world frame
    upright: float  # how far the tool has turned from its direction at the start to straight down, 0 to 1
    opening: float  # target of the gripper [0..1]


class Plan:
    """The path of one grasp, through way-points in the order of their times; the first is the start."""

    def __init__(self, way_points: list[WayPoint]) -> None:
        self._way_points = way_points

    @property
    def duration_s(self) -> float:
        """Time of the last way-point [s]."""
        return self._way_points[-1].time_s

    @property
    def grip_s(self) -> float:
        """Time at which the fingers begin to close [s]."""
        return self._way_points[PHASES.index("grip")].time_s  # the first way-point is the start

    def at(self, time_s: float) -> Command:
        """Return what is asked for at a time since the start [s].

        Between two way-points the position follows the minimum-jerk polynomial (Flash and Hogan 1985, eq. 5), after
        the last it stays. The tool turns upright on the way to the first.
        """
        for start, end in zip(self._way_points, self._way_points[1:], strict=False):
            if time_s < end.time_s:
                s = max(0.0, (time_s - start.time_s) / (end.time_s - start.time_s))
                blend = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
                upright = blend if start is self._way_points[0] else 1.0
                return Command(start.pos_w + blend * (end.pos_w - start.pos_w), upright, end.opening)
        return Command(self._way_points[-1].pos_w, 1.0, self._way_points[-1].opening)


def plan_grasp(start_pos_w: NDArray[np.float64], block_pos_w: NDArray[np.float64], variation: Variation) -> Plan:
    """Plan how to fetch a block and put it into the tray, from where the grasp point is now, both (3,) [m]."""
    block_xy, tray_xy = block_pos_w[:2], np.array(layout.TRAY_POS_W) + variation.release_offset_m
    above = [*(block_xy + variation.approach_offset_m), APPROACH_HEIGHT_M + variation.approach_raise_m]
    grip = [*(block_xy + variation.grip_offset_m), GRIP_HEIGHT_M]
    targets: dict[str, tuple[NDArray[np.float64] | list[float], float]] = {
        "approach": (above, OPEN),
        "descend": (grip, OPEN),
        "grip": (grip, CLOSED),
        "lift": ([*block_xy, LIFT_HEIGHT_M + variation.lift_raise_m], CLOSED),
        "carry": ([*tray_xy, TRAY_HEIGHT_M], CLOSED),
        "lower": ([*tray_xy, RELEASE_HEIGHT_M], CLOSED),
        "release": ([*tray_xy, RELEASE_HEIGHT_M], OPEN),
        "leave": ([*tray_xy, TRAY_HEIGHT_M], OPEN),
        "return": (start_pos_w, OPEN),
    }
    time_s = 0.0
    way_points = [WayPoint(0.0, np.asarray(start_pos_w), OPEN)]
    for phase, (pos_w, opening) in targets.items():
        time_s += PHASE_DURATION_S[phase] * variation.pace[PHASES.index(phase)]
        way_points.append(WayPoint(time_s, np.asarray(pos_w), opening))
    return Plan(way_points)
