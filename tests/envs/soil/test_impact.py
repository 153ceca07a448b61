"""Soil that falls into the bucket: its whole momentum comes to the tool, no more and no less.

The expectations are Newton's: what a machine must give to the soil over some time is the soil's change of momentum
plus its weight times that time. The machine gives: the weight of the payload, its momentum where it grows, and less
the impulse of the reaction.
"""

import math

import numpy as np
import pytest

from bench.soil import tool_at
from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil.soil import Soil

EDGE = np.array([-0.5, 0.0, 1.3])


def held(time_s=0.0, velocity=(0.0, 0.0, 0.0), pitch_deg=180.0):
    """Return a bucket that moves with a constant velocity."""
    moving = np.array(velocity)
    return tool_at(EDGE + moving * time_s, math.radians(pitch_deg), moving, 0.0)


def over(tool, count, height_m, spacing_m=0.106):
    """Return (count, 3) points in level layers above the middle of the bucket's opening."""
    points = np.array([(x, y, z) for z in range(20) for x in range(-2, 3) for y in range(-2, 3)][:count], dtype=float)
    return tool.position_w + tool.rotation_w @ [0.68, 0.0, 0.0] + spacing_m * points + [0.0, 0.0, height_m]


def fallen(height_m, count, *, velocity=(0.0, 0.0, 0.0), fidelity="standard", dt_s=TICK_S, seconds=3.0, soil=None):
    """Let soil fall into a bucket; return the soil and the reactions."""
    tool = held(velocity=velocity)
    if soil is None:
        soil = Soil(fidelity=fidelity)
        soil.step(dt_s, tool)
    points = over(tool, count, height_m, 2.2 * soil.parcel_radius_m)
    flight = np.array(velocity) * [1.0, 1.0, 0.0]
    soil.add_parcels(points, np.broadcast_to(flight, points.shape))  # it falls in from above, not from aside
    return soil, [soil.step(dt_s, held(k * dt_s, velocity)) for k in range(1, round(seconds / dt_s) + 1)]


def given(reactions, dt_s, velocity=(0.0, 0.0, 0.0)):
    """Return the momentum (3,) that a machine gave to the soil [N s]; it acts on each reaction in the next step."""
    loads = np.array([0.0] + [r.payload_mass_kg for r in reactions])
    weight = np.array([0.0, 0.0, GRAVITY_M_S2 * dt_s * loads[:-1].sum()])
    taken = np.clip(np.diff(loads), 0.0, None).sum() * np.array(velocity)
    return weight + taken - sum(r.impulse_w_ns for r in reactions)


@pytest.mark.parametrize(
    ("height_m", "fidelity", "dt_s"),
    [(0.5, "standard", 0.02), (1.0, "fine", 0.02), (1.0, "fast", 0.02), (1.0, "standard", 0.007), (2.0, "fast", 0.033)],
)
def test_a_bucket_held_still_stops_all_that_falls_in_and_carries_it(height_m, fidelity, dt_s):
    soil, reactions = fallen(height_m, 50, fidelity=fidelity, dt_s=dt_s)
    mass = 50 * soil.parcel_mass_kg
    assert soil.payload_mass_kg == pytest.approx(mass)  # nothing jumps out
    time = dt_s * len(reactions)
    assert given(reactions, dt_s)[2] == pytest.approx(mass * GRAVITY_M_S2 * time, rel=2e-3)
    np.testing.assert_allclose(given(reactions, dt_s)[:2], 0.0, atol=0.01 * mass)


def test_a_thin_layer_from_3_m_gives_its_mass_times_the_speed_of_its_fall():
    soil, reactions = fallen(3.0, 25)
    drop = 3.0 + held().position_w[2] - soil.parcel_positions_w[:, 2].mean()
    mass = soil.payload_mass_kg
    assert mass == pytest.approx(25 * soil.parcel_mass_kg)
    downward = -sum(r.impulse_w_ns[2] for r in reactions)
    assert downward == pytest.approx(mass * math.sqrt(2.0 * GRAVITY_M_S2 * drop), rel=0.05)
    assert max(-r.impulse_w_ns[2] for r in reactions) > 0.2 * downward  # a blow, not a creep


def test_a_quarter_of_a_ton_from_3_m_is_felt():
    """Some of it jumps out again; what the bucket stops is near m sqrt(2 g h)."""
    soil = Soil()
    soil.step(TICK_S, held())
    count = round(267.0 / soil.parcel_mass_kg)
    soil, reactions = fallen(3.0, count, soil=soil)
    downward = -np.cumsum([r.impulse_w_ns[2] for r in reactions]).min()
    assert soil.payload_mass_kg > 0.7 * 267.0
    assert 0.85 <= downward / (267.0 * math.sqrt(2.0 * GRAVITY_M_S2 * 3.0)) <= 1.3  # the upper layers fall up to 4 m


@pytest.mark.parametrize("velocity", [(0.5, 0.3, 0.2), (-1.0, 0.0, 0.0), (0.0, 0.0, -0.5), (0.0, 0.7, 0.0)])
def test_a_bucket_in_motion_gives_the_soil_its_own_velocity_and_no_more(velocity):
    """The soil begins with the level part of it."""
    soil, reactions = fallen(0.6, 50, velocity=velocity, seconds=2.0)
    mass, moving = soil.payload_mass_kg, np.array(velocity)
    assert mass == pytest.approx(50 * soil.parcel_mass_kg)
    expected = mass * (moving * [0.0, 0.0, 1.0] + [0.0, 0.0, GRAVITY_M_S2 * TICK_S * len(reactions)])
    np.testing.assert_allclose(given(reactions, TICK_S, velocity), expected, atol=2e-3 * expected[2])


def test_soil_that_falls_on_a_sleeping_load_is_felt_through_it():
    soil, _ = fallen(0.3, 50)
    assert soil.parcel_is_asleep.all()
    load, reactions = soil.payload_mass_kg, []
    soil.add_parcels(over(held(), 10, 1.0), np.zeros((10, 3)))
    reactions = [soil.step(TICK_S, held()) for _ in range(150)]
    mass = 10 * soil.parcel_mass_kg
    assert soil.payload_mass_kg == pytest.approx(load + mass)
    weight = GRAVITY_M_S2 * TICK_S * (load + sum(r.payload_mass_kg for r in reactions[:-1]))
    stopped = weight - sum(r.impulse_w_ns[2] for r in reactions)
    assert stopped == pytest.approx((load + mass) * GRAVITY_M_S2 * TICK_S * len(reactions), rel=2e-3)
    assert -np.cumsum([r.impulse_w_ns[2] for r in reactions]).min() > 0.8 * mass * math.sqrt(2.0 * GRAVITY_M_S2 * 0.8)


def test_soil_that_slides_from_one_place_in_the_bucket_to_another_gives_nothing_in_the_end():
    """The bucket is tilted and comes back; over the whole time, only its own turning and the weight are left."""
    soil, _ = fallen(0.2, 40)
    reactions = []
    for k in range(200):
        pitch = 180.0 + 25.0 * math.sin(min(math.pi, 0.03 * k)) ** 2
        reactions.append(soil.step(TICK_S, tool_at(EDGE, math.radians(pitch), np.zeros(3), 0.0)))
    assert soil.payload_mass_kg == pytest.approx(40 * soil.parcel_mass_kg)
    assert max(np.linalg.norm(r.impulse_w_ns) for r in reactions) > 0.1  # it did slide
    total = sum(r.impulse_w_ns for r in reactions)
    assert np.linalg.norm(total) < 1e-3 * soil.payload_mass_kg * GRAVITY_M_S2 * TICK_S * len(reactions)


def test_a_sleeping_load_that_is_carried_gives_nothing():
    soil, _ = fallen(0.2, 40)
    for k in range(1, 50):
        reaction = soil.step(TICK_S, held(k * TICK_S, (0.2 * min(1.0, 0.05 * k), 0.0, 0.1)))
    assert soil.parcel_is_asleep.all()
    np.testing.assert_allclose(np.r_[reaction.impulse_w_ns, reaction.angular_impulse_w_nms], 0.0, atol=1e-9)


def test_the_angular_impulse_is_that_of_the_impulse_where_the_soil_falls():
    soil = Soil()
    soil.step(TICK_S, held())
    points = over(held(), 1, 0.5) + np.array([0.1, 0.2, 0.0])
    soil.add_parcels(points, np.zeros((1, 3)))
    seen = [(soil.step(TICK_S, held()), soil.parcel_positions_w[0]) for _ in range(40)]
    blow, place = max(seen, key=lambda pair: -pair[0].impulse_w_ns[2])
    expected = np.cross(place - held().position_w, blow.impulse_w_ns)
    np.testing.assert_allclose(blow.angular_impulse_w_nms, expected, atol=0.1 * np.linalg.norm(expected))
