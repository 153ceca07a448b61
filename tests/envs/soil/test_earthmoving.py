import math

import numpy as np
import pytest

from lerobot_excav.envs.soil.earthmoving import (
    blunt_edge_factor,
    earthmoving_factors,
    failure_angle,
    failure_table,
)
from validation.soil.earthmoving_factors import FACTORS

FRICTION, STEEL = math.radians(39.0), math.radians(26.0)


@pytest.mark.parametrize(("rake", "failure"), [row[:2] for row in FACTORS])
def test_sand_fails_at_the_tabulated_angles(rake, failure):
    """The experiment earthmoving_factors holds the factors to the same table."""
    assert math.degrees(failure_angle(math.radians(rake), FRICTION, STEEL)) == pytest.approx(failure, abs=0.1)


@pytest.mark.parametrize("rake", [20, 40, 60, 75])
def test_no_other_failure_angle_needs_less(rake):
    best = failure_angle(math.radians(rake), FRICTION, STEEL)
    weights = [
        earthmoving_factors(math.radians(rake), angle, FRICTION, STEEL).weight
        for angle in np.radians(np.arange(2.0, 38.0, 0.5))
    ]
    assert earthmoving_factors(math.radians(rake), best, FRICTION, STEEL).weight <= min(weights) + 1e-12


def test_without_friction_a_vertical_wall_fails_at_45_degrees():
    assert failure_angle(math.pi / 2, 1e-9, 0.0) == pytest.approx(math.pi / 4, abs=1e-4)


def test_a_smooth_vertical_wall_meets_rankine():
    angle = failure_angle(math.pi / 2, FRICTION, 0.0)
    passive = math.tan(math.pi / 4 + FRICTION / 2) ** 2
    assert angle == pytest.approx(math.pi / 4 - FRICTION / 2, abs=1e-4)
    assert 2.0 * earthmoving_factors(math.pi / 2, angle, FRICTION, 0.0).weight == pytest.approx(passive, rel=1e-6)


def test_the_table_holds_the_same_angles():
    table = failure_table(FRICTION, STEEL)
    assert len(table) == 71
    for rake, angle, cohesion, surcharge in table[::14]:
        assert angle == pytest.approx(failure_angle(rake, FRICTION, STEEL))
        factors = earthmoving_factors(rake, angle, FRICTION, STEEL)
        assert (cohesion, surcharge) == (factors.cohesion, factors.surcharge)


def test_a_smooth_blunt_edge_meets_rankine_and_a_rough_one_more():
    passive = math.tan(math.pi / 4 + FRICTION / 2) ** 2
    assert blunt_edge_factor(FRICTION, 0.0) == pytest.approx(passive)
    rough = [blunt_edge_factor(FRICTION, steel) for steel in np.linspace(0.0, FRICTION, 9)]
    assert (np.diff(rough) > 0.0).all()
    assert blunt_edge_factor(FRICTION, 1.1 * FRICTION) > 0.0
