import numpy as np
import pytest

from lerobot_excav.envs.soil import FIDELITIES
from validation.soil import scaling
from validation.soil.experiment import Conditions
from validation.soil.scaling import grid_scaling, parcel_scaling, scaling_plots


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_columns_grow_up_to_the_bound_and_stay_awake_while_they_are_timed(fidelity):
    sizes = [time.size for time in parcel_scaling("sand", fidelity, 0, quick=True)]
    assert sizes == sorted(sizes)
    assert sizes[0] > 60
    assert sizes[-1] <= FIDELITIES[fidelity].most_awake


def test_the_quickest_run_of_every_step_counts():
    runs = iter([[0.0, 0.0], [1.0, 9.0], [5.0, 3.0]])  # the first one loads the kernels
    (time,) = scaling._quickest(lambda size: (np.array(next(runs)), float(size)), [7], 2)
    assert (time.size, time.mean_ms) == (7.0, 2.0)
    assert time.p95_ms == pytest.approx(2.9)


@pytest.mark.slow
def test_grids_grow():
    times = grid_scaling("sand", "fast", 0, quick=True)
    assert [time.size for time in times] == [40, 120]
    assert all(time.mean_ms > 0.0 for time in times)


def test_plots_show_every_fidelity(monkeypatch):
    monkeypatch.setattr(scaling, "parcel_scaling", lambda *_, quick: [scaling.StepTime(100.0, 1.0, 2.0)])
    monkeypatch.setattr(scaling, "grid_scaling", lambda *_, quick: [scaling.StepTime(40.0, 1.0, 2.0)])
    parcels, cells = scaling_plots(Conditions(fidelity="fine"))
    assert (parcels.name, cells.name) == ("scaling", "scaling_grid")
    assert [curve.label for curve in parcels.curves] == list(FIDELITIES)
    assert [curve.label for curve in cells.curves] == ["fine"]
