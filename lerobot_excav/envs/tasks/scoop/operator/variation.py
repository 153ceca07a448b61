"""How one human-like operator's cycle differs from the next."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TREMOR_TIME_S = 0.4  # how long the noise of a hand remembers itself (kind: guess)


@dataclass(frozen=True, kw_only=True)
class Variation:
    """Style of one cycle; every range below is a guess at how practised people differ."""

    speed: float  # fraction of the machine's speed that is used
    entry_along_m: float  # where the edge enters the soil, along the boom from the centre of the patch [m]
    entry_across_m: float  # the same across the boom [m]
    depth_m: float  # depth of cut [m]
    attack_pitch_rad: float  # preferred pitch of the bucket chord at entry [rad]
    cut_volume_m3: float  # soil to sweep before the bucket is rolled in [m3]
    roll_in_pitch_rad: float  # pitch at the end of the cut [rad]; the curl goes on from there
    carry_height_m: float  # height of the bucket pin above the box [m]
    dump_along_m: float  # where the load is dropped, along the boom from the centre of the box [m]
    pauses_s: tuple[float, ...]  # rest before each phase [s], shape (phases,)
    tremor: float  # size of the slow noise on the commands, as a fraction of full stick


def draw_variation(rng: np.random.Generator, *, phase_count: int) -> Variation:
    """Draw the style of one cycle, with a pause before each of its phases."""
    return Variation(
        speed=rng.uniform(0.85, 1.0),
        entry_along_m=rng.uniform(0.12, 0.28),
        entry_across_m=rng.uniform(-0.1, 0.1),
        depth_m=rng.uniform(0.36, 0.46),
        attack_pitch_rad=rng.uniform(-1.5, -1.3),
        # A flat bucket holds little more than this; the curl takes the rest.
        cut_volume_m3=rng.uniform(0.34, 0.46),
        roll_in_pitch_rad=rng.uniform(-2.85, -2.6),
        carry_height_m=rng.uniform(1.5, 1.7),
        dump_along_m=rng.uniform(-0.15, 0.15),
        # Most pauses are short, a few are noticeable.
        pauses_s=tuple(np.minimum(rng.exponential(0.06, phase_count), 0.3)),
        tremor=rng.uniform(0.0, 0.03),
    )


class Tremor:
    """Slow noise of a hand on a joystick: an Ornstein-Uhlenbeck process per axis.

    Its size is the standard deviation as a fraction of full stick.
    """

    def __init__(self, rng: np.random.Generator, *, size: float) -> None:
        self._rng, self._size = rng, size
        self._value = np.zeros(4)

    def step(self, dt_s: float) -> NDArray[np.float64]:
        """Return the noise after a further `dt_s`, shape (4,)."""
        keep = np.exp(-dt_s / TREMOR_TIME_S)
        self._value = keep * self._value + self._size * np.sqrt(1.0 - keep**2) * self._rng.standard_normal(4)
        return self._value
