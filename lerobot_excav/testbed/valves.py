"""What lies between a command and the flow of oil, as far as an emulator needs it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.errors import require


@dataclass(kw_only=True)
class Valves:
    """A dead zone, and a lag of first order behind it.

    Attributes:
        lag_s: Time constant of the lag [s] (kind of the default: guess, within the 0.05 to 0.3 s of small machines).
        dead_zone: Command below which nothing flows; beyond it the rest is rescaled (kind of the default: guess).

    Raises:
        ConfigurationError: A value is not possible.
    """

    lag_s: float = 0.1
    dead_zone: float = 0.03

    def __post_init__(self) -> None:
        require(0.0 <= self.lag_s <= 5.0, f"valve lag {self.lag_s} s is not possible; give 0 to 5")
        require(0.0 <= self.dead_zone < 1.0, f"valve dead zone {self.dead_zone} is not possible; give 0 up to below 1")
        self._flow = np.zeros(4)

    def reset(self) -> None:
        """Close them."""
        self._flow = np.zeros(4)

    def step(self, command: NDArray[np.float64], dt_s: float) -> NDArray[np.float64]:
        """Return what flows after `dt_s` under a command, both (4,) as fractions of full speed."""
        beyond = np.maximum(np.abs(command) - self.dead_zone, 0.0) / (1.0 - self.dead_zone)
        wanted = np.sign(command) * beyond
        share = 1.0 if self.lag_s == 0.0 else 1.0 - np.exp(-dt_s / self.lag_s)
        self._flow = self._flow + share * (wanted - self._flow)
        return self._flow.copy()
