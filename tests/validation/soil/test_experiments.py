"""Every experiment that is cheap enough runs here, with few repetitions and its full gates."""

import numpy as np
import pytest

from validation.soil import (
    blade_force,
    column_collapse,
    determinism,
    earthmoving_factors,
    force_ramp,
    free_fall,
    heap,
    ledger,
    operator_cycle,
    speed,
    stall,
)
from validation.soil.experiment import Conditions

QUICK = Conditions(quick=True, seeds=(0,))
FULL = Conditions(quick=False, seeds=(0, 1, 2))
CHEAP = (earthmoving_factors, blade_force, force_ramp, free_fall, ledger, determinism)
COSTLY = (heap, stall, operator_cycle)


def assert_inside(module, conditions):
    result = module.EXPERIMENT.run(conditions)
    missed = {check.name: (check.value, check.gate_text) for check in result.missed}
    unexplained = {
        name for name, check in zip(missed, result.missed, strict=True) if not module.EXPERIMENT.reason(check)
    }
    assert not unexplained, missed
    return result


def named(modules):
    return pytest.mark.parametrize("module", modules, ids=lambda module: module.EXPERIMENT.code)


@named(CHEAP)
def test_a_cheap_experiment_is_inside_its_gates_or_says_why_not(module):
    assert assert_inside(module, QUICK).checks


@pytest.mark.slow
@named(COSTLY)
def test_a_costly_experiment_is_inside_its_gates_or_says_why_not(module):
    assert assert_inside(module, QUICK).checks


@pytest.mark.slow
def test_columns_collapse_like_those_of_the_experiments():
    """One arrangement of each column scatters too much for a fit through two of them."""
    assert assert_inside(column_collapse, FULL).checks


@pytest.mark.slow
def test_times_and_parcel_counts_are_reported_without_a_verdict_here():
    result = speed.EXPERIMENT.run(QUICK)
    assert speed.EXPERIMENT.is_timed
    assert all(check.value > 0.0 for check in result.checks)


@pytest.mark.parametrize("fidelity", ["fast", "fine"])
@pytest.mark.parametrize("preset", ["gravel", "wet_sand"])
def test_soil_and_fidelity_reach_the_experiment(preset, fidelity):
    standard = free_fall.EXPERIMENT.run(QUICK).plots[0].curves[0].y
    other = free_fall.EXPERIMENT.run(Conditions(quick=True, seeds=(0,), preset=preset, fidelity=fidelity))
    assert not np.array_equal(other.plots[0].curves[0].y, standard)


def test_seeds_reach_the_experiment():
    first = free_fall.energies_of_a_dump_j(preset="sand", fidelity="fast", seed=0)
    other = free_fall.energies_of_a_dump_j(preset="sand", fidelity="fast", seed=1)
    assert first.tobytes() != other.tobytes()
