"""Fundamental equation of earthmoving: resistance of a soil wedge before a flat blade.

Reece 1965, McKyes 1985, for rake a (blade from the horizontal), failure angle b, friction phi and soil-steel
friction delta:

    D  = cos(a + delta) + sin(a + delta) cot(b + phi)
    Ng = (cot a + cot b) / (2 D)          weight
    Nc = (1 + cot b cot(b + phi)) / D     cohesion
    Nq = 2 Ng                             surcharge
    Na = (tan b + cot(b + phi)) / (D (1 + tan b cot a))   inertia

    P = (gamma d^2 Ng + c d Nc + q d Nq + rho v^2 d Na) w

The failure angle is the one with the least Ng. For a wedge of weight W the weight term is
P = W sin(b + phi) / sin(a + delta + b + phi), which holds on any surface.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from lerobot_excav.envs.soil.arrays import Array

RAKE_MIN_RAD = math.radians(20.0)
RAKE_MAX_RAD = math.radians(90.0)
"""Range of the rake. A flatter blade finds no least wedge; a steeper one leans over the soil, where other laws hold.

Near 90 degrees a wedge of dead soil forms on the blade (Miedema, ch. 11) and the planar wedge gives about 1.5 times the
log spiral's force; yet forces measured at 75 and 90 degrees match it (Hatamura and Chijiiwa 1977)."""

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True, kw_only=True)
class EarthmovingFactors:
    """Dimensionless factors of the fundamental equation of earthmoving."""

    weight: float
    cohesion: float
    surcharge: float
    inertia: float


def _cot(angle: float) -> float:
    return math.cos(angle) / math.sin(angle)


def earthmoving_factors(
    rake_rad: float, failure_rad: float, friction_rad: float, steel_rad: float
) -> EarthmovingFactors:
    """Return the factors for a blade and a failure plane; formulas at the head of this module."""
    turned = _cot(failure_rad + friction_rad)
    divisor = math.cos(rake_rad + steel_rad) + math.sin(rake_rad + steel_rad) * turned
    weight = (_cot(rake_rad) + _cot(failure_rad)) / (2.0 * divisor)
    return EarthmovingFactors(
        weight=weight,
        cohesion=(1.0 + _cot(failure_rad) * turned) / divisor,
        surcharge=2.0 * weight,
        inertia=(math.tan(failure_rad) + turned) / (divisor * (1.0 + math.tan(failure_rad) * _cot(rake_rad))),
    )


def failure_angle(rake_rad: float, friction_rad: float, steel_rad: float) -> float:
    """Return the failure angle [rad] with the least weight factor, by golden-section search.

    The search covers the angles at which the wedge can be in balance: b + a + delta + phi below pi.
    """
    low = math.radians(1.0)
    high = min(math.radians(85.0), math.pi - rake_rad - steel_rad - friction_rad - math.radians(0.5))

    def weight(angle: float) -> float:
        return earthmoving_factors(rake_rad, angle, friction_rad, steel_rad).weight

    for _ in range(60):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if weight(left) < weight(right):
            high = right
        else:
            low = left
    return 0.5 * (low + high)


def blunt_edge_factor(friction_rad: float, steel_rad: float) -> float:
    """Return the passive coefficient of an upright blunt edge in Balovnev's equation: its A at 90 degrees.

    It is multiplied with half the weight of soil over the edge's thickness, the overburden at rest on the surface ahead
    (its active part), and c cot(phi). Read in NASA's ow_simulator (`BalovnevModelPlugin.cpp`, `getParameterA`,
    github.com/nasa/ow_simulator at d6e3d506).
    """
    s, t = math.sin(friction_rad), math.sin(steel_rad)
    lean = steel_rad + (math.asin(t / s) if t < s else 0.5 * math.pi)
    rough = math.cos(steel_rad) + math.sqrt(max(0.0, s * s - t * t))
    return math.cos(steel_rad) * rough / (1.0 - s) * math.exp(lean * math.tan(friction_rad))


@cache
def failure_table(friction_rad: float, steel_rad: float) -> Array:
    """Return (n, 4) rows of rake [rad], failure angle [rad], cohesion and surcharge factor, by 1 degree of rake."""
    count = round(math.degrees(RAKE_MAX_RAD - RAKE_MIN_RAD)) + 1
    rows = []
    for rake in np.linspace(RAKE_MIN_RAD, RAKE_MAX_RAD, count):
        angle = failure_angle(rake, friction_rad, steel_rad)
        factors = earthmoving_factors(rake, angle, friction_rad, steel_rad)
        rows.append((rake, angle, factors.cohesion, factors.surcharge))
    table = np.array(rows)
    table.flags.writeable = False  # every soil of the same friction shares it
    return table
