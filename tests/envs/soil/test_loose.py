import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil.container import Container
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.soil import Soil

TILTED = Container(center_w=[5.0, 0.5, 0.2], half_extent_m=[1.0, 0.6], wall_height_m=0.8, yaw_rad=0.4)


def fall(soil, seconds):
    for _ in range(round(seconds / TICK_S)):
        soil.step(TICK_S)


def dropped(positions, velocities=None, seconds=0.0, **settings):
    """Return a soil with parcels that have fallen for some time."""
    soil = Soil(**settings)
    soil.add_parcels(positions, np.zeros_like(positions) if velocities is None else velocities)
    fall(soil, seconds)
    return soil


@given(
    velocity=st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-1, 3)),
    fidelity=st.sampled_from(sorted(FIDELITIES)),
)
@settings(max_examples=20)
def test_the_flight_is_a_parabola_and_gains_no_energy(velocity, fidelity):
    """Semi-implicit Euler falls g t dt / 2 too far and loses g^2 t dt / 2 of energy per kilogram."""
    soil = Soil(fidelity=fidelity)
    start, time, substep = np.array([0.0, 0.0, 5.0]), 0.4, TICK_S / soil.fidelity.substeps_per_tick
    soil.add_parcels([start], [velocity])
    energy = soil.mechanical_energy_j()
    fall(soil, time)
    expected = start + time * np.array(velocity)
    expected[2] -= 0.5 * GRAVITY_M_S2 * time * (time + substep)
    np.testing.assert_allclose(soil.parcel_positions_w[0], expected, atol=1e-9)
    lost = energy - soil.mechanical_energy_j()
    assert lost == pytest.approx(0.5 * soil.parcel_mass_kg * GRAVITY_M_S2**2 * time * substep, rel=1e-6)


def test_each_parcel_brings_its_mass_and_lands_where_it_falls():
    soil = dropped([[0.0, 0.0, 1.0], [-3.75, 4.75, 1.0], [4.0, 0.0, 1.0]], container=TARGET_BOX)
    assert soil.ledger_kg()["parcels"] == pytest.approx(3 * soil.parcel_mass_kg)
    fall(soil, 1.5)
    ledger = soil.ledger_kg()
    for place in ("grid", "box", "out_of_bounds"):
        assert ledger[place] == pytest.approx(soil.parcel_mass_kg)


def test_a_parcel_above_the_wall_flies_over_it():
    axis = TILTED.axes_w[0]
    start, velocity = [*(TILTED.center_w[:2] + 1.6 * axis), 1.6], [*(-3.0 * axis), 0.0]
    soil = dropped([start], [velocity], 2.0, container=TILTED)
    assert soil.ledger_kg()["box"] == pytest.approx(soil.parcel_mass_kg)


@given(x=st.floats(3.0, 7.0), y=st.floats(-2.0, 3.0), vx=st.floats(-9, 9), vy=st.floats(-9, 9), z=st.floats(0.3, 2.0))
@settings(max_examples=60)
def test_no_parcel_passes_a_wall_below_its_top(x, y, vx, vy, z):
    beyond = np.abs(TILTED.to_local(np.array([x, y]))) - TILTED.half_extent_m
    starts_inside = bool((beyond < 0.0).all())
    soil = dropped([[x, y, z]], [[vx, vy, 0.0]], 2.5, container=TILTED)
    in_box = soil.ledger_kg()["box"] > 0.0
    assert sum(soil.ledger_kg().values()) == pytest.approx(soil.parcel_mass_kg)
    if z + soil.parcel_radius_m < 1.0:  # below the top of the wall all the way
        assert in_box == starts_inside


def test_soil_heaped_above_the_wall_runs_out_of_the_box():
    small = Container(center_w=[4.0, 0.0, 0.0], half_extent_m=[0.2, 0.2], wall_height_m=0.2, yaw_rad=0.0)
    soil = Soil(container=small)
    for _ in range(100):
        soil.add_parcels([[4.0, 0.0, 0.9]], np.zeros((1, 3)))
        fall(soil, 0.4)
    fall(soil, 1.0)
    ledger = soil.ledger_kg()
    assert ledger["out_of_bounds"] > 5.0
    assert sum(ledger.values()) == pytest.approx(100 * soil.parcel_mass_kg, abs=1e-6)
    assert soil.container_heights_m is not None
    assert soil.container_heights_m[0].max() < 0.2 + 0.05


def test_loose_parcels_weigh_on_the_column_that_they_are_over():
    soil = Soil(extent_m=(2.0, 2.0))
    soil.reset(np.full((40, 40), 0.1))
    soil.add_parcels([[0.312, -0.187, 1.0], [0.312, -0.187, 1.2], [5.0, 0.0, 1.0]], np.zeros((3, 3)))
    added = soil._loose.weighed_heights() - soil.heights_m
    i, j = np.argmin(np.abs(soil.x_w - 0.312)), np.argmin(np.abs(soil.y_w + 0.187))
    assert added[i, j] * 0.05**2 * soil.density_kg_m3 == pytest.approx(2 * soil.parcel_mass_kg)
    assert np.count_nonzero(added) == 1


@pytest.mark.parametrize("extent", [2.0, 3.0])
def test_a_parcel_just_inside_the_border_weighs_on_the_last_column(extent):
    """Rounding puts it half a cell beyond that column's centre, which is as near to the next one."""
    last = float(np.nextafter(extent / 2, 0.0))
    soil = dropped([[last, -last, 1.0]], extent_m=(extent, extent), cell_size_m=extent / 40)
    assert np.argwhere(soil._loose.weighed_heights()).tolist() == [[39, 0]]


@pytest.mark.parametrize("offset", [-0.001, 0.001])
def test_a_parcel_on_the_rim_of_the_box_drops_after_a_while(offset):
    wall_x = TARGET_BOX.center_w[0] + TARGET_BOX.half_extent_m[0]
    soil = dropped([[wall_x + offset, TARGET_BOX.center_w[1], 1.3]], seconds=4.0, container=TARGET_BOX)
    ledger = soil.ledger_kg()
    assert soil.airborne_mass_kg == 0.0
    assert ledger["box"] + ledger["out_of_bounds"] == pytest.approx(soil.parcel_mass_kg)


@pytest.mark.parametrize("mass_kg", [1e-6, 1e-4, 1e-2])
def test_a_crumb_lands_and_does_not_sink_through_the_ground(mass_kg):
    soil = Soil("wet_sand")
    soil.reset(np.full((120, 120), 0.3))
    soil._loose.population.add(np.array([[0.0, 0.0, 0.5]]), np.zeros((1, 3)), np.array([mass_kg]), apart=False)
    fall(soil, 3.0)
    assert soil.airborne_mass_kg == 0.0


@given(seed=st.integers(0, 2**16))
@settings(max_examples=20)
def test_weighed_heights_are_those_of_whole_arrays(seed):
    rng, soil = np.random.default_rng(seed), Soil(extent_m=(2.0, 2.0))
    soil.add_parcels(rng.uniform([-1.2, -1.2, 4.0], [1.2, 1.2, 6.0], (60, 3)), np.zeros((60, 3)))
    state, expected = soil._loose.population.state, soil.heights_m.copy()
    state.load[::3] = 1
    lies = (state.load == 0) & (np.abs(state.positions[:, :2]) < 1.0).all(axis=1)
    cells = np.clip(np.rint((state.positions[lies, :2] - soil.x_w[0]) / 0.05).astype(int), 0, 39)
    np.add.at(expected, tuple(cells.T), state.masses[lies] / soil.density_kg_m3 / 0.05**2)
    np.testing.assert_allclose(soil._loose.weighed_heights(), expected, rtol=1e-12)
    state.load[:] = 1
    np.testing.assert_array_equal(soil._loose.weighed_heights(), soil.heights_m)
