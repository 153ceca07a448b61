import numpy as np
import pytest

from bench import soil as bench
from lerobot_excav.envs.soil import FIDELITIES, Soil
from validation.soil import scaling
from validation.soil.experiment import Conditions

QUICK = Conditions(quick=True, seeds=(0,))


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_columns_grow_up_to_the_bound_and_stay_awake_while_they_are_timed(fidelity):
    sizes = [time.size for time in scaling.parcel_scaling(fidelity, QUICK)]
    assert sizes == sorted(sizes)
    assert 60 < sizes[0] < sizes[-1] <= FIDELITIES[fidelity].most_awake


def test_the_quickest_run_of_every_step_counts(monkeypatch):
    runs = iter([[1.0, 9.0], [5.0, 3.0]])
    timed = lambda soil, tools: bench.StepTimes(np.array(next(runs)), np.zeros(2), np.zeros(2))  # noqa: E731
    monkeypatch.setattr(bench, "timed_steps", timed)
    assert bench.quickest_steps(Soil, [None] * 2, 2).ms.tolist() == [1.0, 3.0]
