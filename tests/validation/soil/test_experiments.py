"""Quick experiments run here, with few repetitions and their full gates; `make validate` runs all of them."""

import numpy as np
import pytest

from validation.soil import free_fall
from validation.soil.catalogue import EXPERIMENTS
from validation.soil.experiment import Conditions

QUICK = Conditions(quick=True, seeds=(0,))
CHEAP = ("blade_force", "earthmoving_factors", "free_fall", "ledger", "force_ramp", "ridge", "stall")


@pytest.mark.slow
@pytest.mark.parametrize("experiment", [pytest.param(e, id=e.name) for e in EXPERIMENTS if e.name in CHEAP])
def test_an_experiment_is_inside_its_gates_or_says_why_not(experiment):
    result = experiment.run(QUICK)
    assert result.checks
    assert not [(c.name, c.value, c.gate_text) for c in result.missed if not experiment.reason(c)]


@pytest.mark.parametrize("fidelity", ["fast", "fine"])
@pytest.mark.parametrize("preset", ["gravel", "wet_sand"])
def test_soil_and_fidelity_reach_the_experiment(preset, fidelity):
    standard = free_fall.energies_of_a_dump_j(preset="sand", fidelity="standard", seed=0)
    other = free_fall.run.run(Conditions(quick=True, seeds=(0,), preset=preset, fidelity=fidelity))
    assert not np.array_equal(other.plots[0].curves[0].y, standard)


def test_seeds_reach_the_experiment():
    first, again, other = (
        free_fall.energies_of_a_dump_j(preset="sand", fidelity="fast", seed=s).tobytes() for s in (0, 0, 1)
    )
    assert first == again != other
