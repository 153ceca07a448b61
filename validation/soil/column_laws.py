"""Published laws of collapsing columns, and the fit that compares with them."""

import math
from collections.abc import Sequence

import numpy as np

LUBE_FIT = (1.24, 1.0, 1.6, 0.5)
LAJEUNESSE_FIT = (1.35, 1.0, 2.0, 0.5)
"""Prefactor and exponent of the run-out of low and of tall columns."""

_LUBE_BREAK = 1.7
_LAJEUNESSE_BREAK = 3.0


def lube_run_out(aspect: float) -> float:
    """Run-out (r - r0) / r0 of Lube et al. 2004."""
    return 1.24 * aspect if aspect < _LUBE_BREAK else 1.6 * math.sqrt(aspect)


def lajeunesse_run_out(aspect: float) -> float:
    """Run-out (r - r0) / r0 of Lajeunesse et al. 2004."""
    return 1.35 * aspect if aspect < _LAJEUNESSE_BREAK else 2.0 * math.sqrt(aspect)


def lube_height(aspect: float) -> float:
    """Final height over initial radius of Lube et al. 2004: a below 1, 0.88 a^(1/6) above 1.7; between, the smaller."""
    return min(aspect, 0.88 * math.pow(aspect, 1.0 / 6.0))


def lajeunesse_height(aspect: float) -> float:
    """Final height over initial radius of Lajeunesse et al. 2004."""
    return min(aspect, 0.74)


def cone_run_out(aspect: float, friction_deg: float) -> float:
    """Run-out of the cone with the volume of the column and the slope of the friction angle."""
    return math.cbrt(3.0 * aspect / math.tan(math.radians(friction_deg))) - 1.0


def power_law(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Fit y = prefactor * x ** exponent by least squares of the logarithms.

    Returns:
        Prefactor and exponent.
    """
    exponent, logarithm = np.polyfit(np.log(x), np.log(y), 1)
    return float(np.exp(logarithm)), float(exponent)
