import math

import numpy as np
import pytest

from lerobot_excav.envs.soil.earthmoving import earthmoving_factors, failure_angle, failure_table

FRICTION, STEEL = math.radians(39.0), math.radians(26.0)

# rake and failure angle [deg], N_gamma, N_c, N_q, N_a for friction 39 and soil-steel friction 26 degrees
TABLE = [
    (20, 31.0, 2.31, 1.68, 4.61, 0.38),
    (30, 31.4, 1.97, 1.85, 3.94, 0.55),
    (40, 29.7, 1.93, 2.21, 3.86, 0.75),
    (50, 27.0, 2.08, 2.78, 4.16, 0.99),
    (60, 23.7, 2.44, 3.72, 4.88, 1.31),
    (70, 20.0, 3.16, 5.38, 6.31, 1.73),
    (80, 15.9, 4.61, 8.66, 9.22, 2.36),
    (90, 11.7, 8.12, 16.7, 16.2, 3.45),
]


@pytest.mark.parametrize(("rake", "failure", "weight", "cohesion", "surcharge", "inertia"), TABLE)
def test_the_factors_of_sand(rake, failure, weight, cohesion, surcharge, inertia):
    angle = failure_angle(math.radians(rake), FRICTION, STEEL)
    factors = earthmoving_factors(math.radians(rake), angle, FRICTION, STEEL)
    assert math.degrees(angle) == pytest.approx(failure, abs=0.1)
    assert factors.weight == pytest.approx(weight, rel=0.01)
    assert factors.cohesion == pytest.approx(cohesion, rel=0.01)
    assert factors.surcharge == pytest.approx(surcharge, rel=0.01)
    assert factors.inertia == pytest.approx(inertia, rel=0.01)


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
    assert 2.0 * earthmoving_factors(math.pi / 2, angle, FRICTION, 0.0).weight == pytest.approx(
        passive, rel=1e-6
    )


def test_the_table_holds_the_same_angles():
    table = failure_table(FRICTION, STEEL)
    assert len(table) == 71
    for rake, angle, cohesion, surcharge in table[::14]:
        assert angle == pytest.approx(failure_angle(rake, FRICTION, STEEL))
        factors = earthmoving_factors(rake, angle, FRICTION, STEEL)
        assert (cohesion, surcharge) == (factors.cohesion, factors.surcharge)
