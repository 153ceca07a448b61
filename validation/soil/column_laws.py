"""Published laws of collapsing columns, and the fit that compares with them."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np


class ColumnLaw(NamedTuple):
    """A published law of columns by their aspect ratio a; run-outs are (r - r0) / r0, heights those over r0."""

    label: str
    low: float  # run-out over a of low columns
    tall: float  # run-out over sqrt(a) of tall ones
    tall_from: float  # aspect ratio from which a column is tall
    height: Callable[[float], float]  # final height

    def run_out(self, aspect: float) -> float:
        """Return the run-out."""
        return self.low * aspect if aspect < self.tall_from else self.tall * math.sqrt(aspect)


# Height of Lube et al.: a below 1, 0.88 a^(1/6) above 1.7; between, the smaller.
LUBE = ColumnLaw("Lube", 1.24, 1.6, 1.7, lambda a: min(a, 0.88 * math.pow(a, 1.0 / 6.0)))
LAJEUNESSE = ColumnLaw("Lajeunesse", 1.35, 2.0, 3.0, lambda a: min(a, 0.74))


def cone_run_out(aspect: float, friction_deg: float) -> float:
    """Return the run-out of the cone with the volume of the column and the slope of the friction angle."""
    return math.cbrt(3.0 * aspect / math.tan(math.radians(friction_deg))) - 1.0


def power_law(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Fit y = prefactor * x ** exponent by least squares of the logarithms; return prefactor and exponent."""
    exponent, logarithm = np.polyfit(np.log(x), np.log(y), 1)
    return float(np.exp(logarithm)), float(exponent)
