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
    """Style of one grasp."""

    approach_offset_m: NDArray[np.float64]  # of the point above the block in the plane [m], (2,)
    approach_raise_m: float  # of its height [m]
    grip_offset_m: NDArray[np.float64]  # of the grip in the plane [m], (2,)
    lift_raise_m: float  # of the height after lifting [m]
    release_offset_m: NDArray[np.float64]  # of the place in the tray [m], (2,)
    pace: NDArray[np.float64]  # factor on the duration of each phase, (phases,)


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
