"""A load in the bucket from the outside: it sleeps, travels, survives, wakes and pours."""

import math

import numpy as np
import pytest

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.soil import Soil

EDGE = np.array([0.0, 0.0, 2.0])


def held(pitch_deg=180.0, edge=EDGE, velocity=(0.0, 0.0, 0.0)):
    return tool_at(np.array(edge), math.radians(pitch_deg), np.array(velocity), 0.0)


def wait(soil, tool, ticks):
    for _ in range(ticks):
        soil.step(TICK_S, tool)


def filled(fidelity="fast", count=60):
    """Return a soil with a load asleep in a bucket in the air: parcels rained into it."""
    soil, tool = Soil(fidelity=fidelity), held()
    soil.step(TICK_S, tool)
    lattice = np.array(
        [(x, y, z) for z in (0.1, -0.1, -0.3, -0.5) for y in (-0.2, 0.0, 0.2) for x in np.linspace(0.4, 0.9, 5)]
    )
    start = tool.position_w + lattice[:count] @ tool.rotation_w.T
    soil.add_parcels(start, np.zeros_like(start))
    for _ in range(200):
        soil.step(TICK_S, tool)
        if soil.parcel_is_asleep.all():
            return soil
    raise AssertionError("the load does not sleep")


def places_t(soil, tool):
    return (soil.parcel_positions_w - tool.position_w) @ tool.rotation_w


@pytest.mark.parametrize("fidelity", ["fast", "standard", "fine"])
def test_parcels_that_come_to_rest_in_a_still_bucket_are_a_load_asleep_and_its_payload(fidelity):
    soil, tool = filled(fidelity), held()
    assert soil.parcel_is_load.all()
    assert soil.awake_parcel_count == 0
    assert soil.airborne_mass_kg == 0.0
    inside = places_t(soil, tool) @ BUCKET.planes_t[:, :3].T - BUCKET.planes_t[:, 3]
    assert inside[:, 1:].max() < 0.0
    reaction, masses = soil.step(TICK_S, tool), soil.parcel_masses_kg
    assert reaction.payload_mass_kg == soil.payload_mass_kg == pytest.approx(60 * soil.parcel_mass_kg)
    np.testing.assert_allclose(reaction.payload_com_t, masses @ places_t(soil, tool) / masses.sum(), atol=1e-12)


def test_a_sleeping_load_travels_as_one_body_with_the_velocity_of_the_bucket():
    soil = filled()
    places = places_t(soil, held())
    edge, velocity = EDGE.copy(), np.zeros(3)
    for _ in range(60):
        velocity = velocity + np.array([0.3, 0.4, 0.2]) * TICK_S  # a gentle start: 0.5 m/s2
        edge = edge + velocity * TICK_S
        tool = held(180.0, edge, velocity)
        soil.step(TICK_S, tool)
        assert soil.parcel_is_asleep.all()
        np.testing.assert_allclose(places_t(soil, tool), places, atol=1e-9)
        np.testing.assert_allclose(soil.parcel_velocities_w, np.tile(velocity, (60, 1)), atol=1e-9)


def test_a_load_that_something_falls_on_wakes_and_takes_it_up():
    soil = filled()
    soil.add_parcels([held().position_w + held().rotation_w @ [0.6, 0.0, -0.6]], np.zeros((1, 3)))
    woke = False
    for _ in range(150):
        soil.step(TICK_S, held())
        woke = woke or soil.awake_parcel_count > 1
    assert woke
    assert soil.parcel_is_asleep.all()
    assert soil.payload_mass_kg == pytest.approx(61 * soil.parcel_mass_kg)


def test_a_load_outlives_the_absence_of_its_bucket_and_another_place():
    soil = filled()
    places, mass = places_t(soil, held()), soil.payload_mass_kg
    wait(soil, None, 30)
    assert soil.payload_mass_kg == mass
    assert soil.parcel_is_asleep.all()
    assert not soil.parcel_velocities_w.any()
    elsewhere = held(180.0, (1.5, -1.0, 1.2))
    soil.step(TICK_S, elsewhere)
    assert soil.payload_mass_kg == mass
    assert np.linalg.norm(places_t(soil, elsewhere) - places, axis=1).max() < 0.01
    wait(soil, elsewhere, 100)
    assert soil.payload_mass_kg == mass
    assert soil.parcel_is_asleep.all()


def test_a_bucket_that_comes_back_upside_down_loses_its_load():
    soil = filled()
    wait(soil, None, 3)
    wait(soil, held(0.0), 60)
    assert soil.payload_mass_kg == 0.0
    assert soil.airborne_mass_kg + soil.ledger_kg()["grid"] == pytest.approx(60 * soil.parcel_mass_kg)


def test_a_poured_load_leaves_through_the_opening_and_lands():
    soil = filled()
    opening = BUCKET.planes_t[0]
    left = 0
    for tick in range(120):
        was_load = soil.parcel_is_load
        tool = held(180.0 + min(1.5 * tick, 120.0))
        soil.step(TICK_S, tool)
        if len(soil.parcel_is_load) == len(was_load):  # none has landed: the rows are the same parcels
            loosened = was_load & ~soil.parcel_is_load
            left += int(loosened.sum())
            beyond = places_t(soil, tool)[loosened] @ opening[:3] - opening[3]
            assert (beyond > -soil.parcel_radius_m).all()
    assert left > 20
    assert soil.payload_mass_kg == 0.0
    wait(soil, None, 100)
    assert soil.ledger_kg()["grid"] == pytest.approx(60 * soil.parcel_mass_kg)


def test_the_remainder_that_is_less_than_a_parcel_leaves_with_the_load():
    soil = Soil(fidelity="fast")
    soil.reset(np.full((120, 120), 0.5))
    for tick in range(40):
        soil.step(TICK_S, held(-120.0, (0.5 - 0.01 * tick, 0.0, 0.35)))
    total = sum(soil.ledger_kg().values())
    remainder = soil._bucket.waiting_m3
    assert 0.0 < remainder * soil.density_kg_m3 < soil.parcel_mass_kg
    for tick in range(150):
        soil.step(TICK_S, held(-120.0 + min(tick, 90), (0.1, 0.0, 0.35 + 0.01 * min(tick, 100))))
    assert soil.payload_mass_kg == 0.0
    assert soil._bucket.waiting_m3 == 0.0
    assert sum(soil.ledger_kg().values()) == pytest.approx(total, abs=1e-6)
