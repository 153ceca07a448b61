"""How one grasp of the scripted operator differs from the next."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Spread of the way-points and paces (kind: tuned, to what a person's hand would do and the task still allows).
APPROACH_SPREAD_M = 0.006
RAISE_SPREAD_M = 0.008
GRIP_SPREAD_M = 0.0015
RELEASE_SPREAD_M = 0.010
PACE_RANGE = (0.9, 1.1)


@dataclass(frozen=True, kw_only=True)
class Variation:
    """Style of one grasp.

    Attributes:
        approach_offset_m: Of the point above the block in the plane [m], (2,).
        approach_raise_m: Of its height [m].
        grip_offset_m: Of the grip in the plane [m], (2,).
        lift_raise_m: Of the height after lifting [m].
        release_offset_m: Of the place in the tray [m], (2,).
        pace: Factor on the duration of each phase, (phases,).
    """

    approach_offset_m: NDArray[np.float64]
    approach_raise_m: float
    grip_offset_m: NDArray[np.float64]
    lift_raise_m: float
    release_offset_m: NDArray[np.float64]
    pace: NDArray[np.float64]


def draw_variation(rng: np.random.Generator, *, phase_count: int) -> Variation:
    """Draw the style of a grasp of so many phases."""
    return Variation(
        approach_offset_m=rng.normal(0.0, APPROACH_SPREAD_M, size=2),
        approach_raise_m=float(rng.normal(0.0, RAISE_SPREAD_M)),
        grip_offset_m=rng.normal(0.0, GRIP_SPREAD_M, size=2),
        lift_raise_m=float(rng.normal(0.0, RAISE_SPREAD_M)),
        release_offset_m=rng.normal(0.0, RELEASE_SPREAD_M, size=2),
        pace=rng.uniform(*PACE_RANGE, size=phase_count),
    )
