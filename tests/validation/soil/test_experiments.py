"""Every experiment runs here, with few repetitions and its full gates."""

import numpy as np
import pytest

from validation.soil import free_fall
from validation.soil.catalogue import EXPERIMENTS
from validation.soil.experiment import Conditions

QUICK = Conditions(quick=True, seeds=(0,))
CHEAP = ("blade_force", "earthmoving_factors", "free_fall", "ledger", "determinism", "force_ramp")


@pytest.mark.parametrize(
    "experiment", [pytest.param(e, id=e.name, marks=() if e.name in CHEAP else pytest.mark.slow) for e in EXPERIMENTS]
)
def test_an_experiment_is_inside_its_gates_or_says_why_not(experiment):
    # One arrangement of each column scatters too much for a fit through two of them.
    result = experiment.run(Conditions() if experiment.name == "column_collapse" else QUICK)
    assert result.checks or experiment.name == "newton_peer"  # a comparison has no gate
    if experiment.is_timed:
        assert all(check.value > 0.0 for check in result.checks)
    else:
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
