import math

import numpy as np
import pytest

from bench.soil import cone, dig_cycle, real_time_factor, tool_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil.bucket import heaped_volume_m3
from lerobot_excav.envs.soil.soil import Soil
from lerobot_excav.envs.soil.tool import Reaction

LIFTED = 350
"""Ticks until the load is lifted clear of the pile."""

OVER_BOX = LIFTED + 145
"""Ticks until it hangs over the box."""


@pytest.fixture(scope="module")
def cycle():
    soil = Soil(container=TARGET_BOX)
    soil.reset(cone(soil))
    reactions, ledgers, awake = [], [], []
    for tool in dig_cycle():
        reactions.append(soil.step(TICK_S, tool))
        ledgers.append(soil.ledger_kg())
        awake.append(soil.awake_parcel_count)
    return soil, reactions, ledgers, awake


Cycle = tuple[Soil, list[Reaction], list[dict[str, float]], list[int]]


def test_the_bucket_fills_as_an_operator_fills_it(cycle):
    """The band of experiment T8: 485 +- 65 kg."""
    assert 420.0 <= cycle[2][LIFTED]["bucket"] <= 550.0


def test_next_to_nothing_is_lost_on_the_way_to_the_box(cycle):
    assert cycle[2][OVER_BOX]["bucket"] == pytest.approx(cycle[2][LIFTED]["bucket"], rel=0.02)


def test_the_load_sleeps_on_the_way_to_the_box(cycle):
    assert min(cycle[3][LIFTED:OVER_BOX]) == 0


def test_the_dump_empties_the_bucket_into_the_box(cycle):
    assert cycle[2][-1]["bucket"] == 0.0
    assert cycle[2][-1]["box"] > 0.97 * cycle[2][LIFTED]["bucket"]
    assert cycle[2][-1]["parcels"] == 0.0


def test_the_dump_takes_about_a_second(cycle):
    held = np.array([ledger["bucket"] for ledger in cycle[2]])
    start = np.flatnonzero(held > 0.95 * held[LIFTED])[-1]
    end = np.flatnonzero(held > 0.05 * held[LIFTED])[-1]
    assert 0.5 <= (end - start) * TICK_S <= 1.5


def test_soil_falls_before_it_is_in_the_box(cycle):
    falling = np.array([ledger["parcels"] for ledger in cycle[2]])[OVER_BOX:]
    gained = np.array([ledger["box"] for ledger in cycle[2]])[OVER_BOX:]
    assert falling.max() > 0.5 * cycle[2][LIFTED]["bucket"]
    assert np.argmax(falling) < np.argmax(gained > 0.5 * gained[-1])


def test_digging_meets_resistance_and_carrying_none(cycle):
    forces = np.array([np.linalg.norm(reaction.force_w_n) for reaction in cycle[1]])
    assert 2e3 < forces[100:200].mean() < 40e3
    assert not forces[LIFTED:].any()


def test_the_payload_sits_low_in_the_carried_bucket(cycle):
    com = cycle[1][LIFTED].payload_com_t
    assert 0.3 < com[0] < 0.9
    assert abs(com[1]) < 0.02
    assert 0.05 < com[2] < 0.35


def filled(soil):
    soil.reset(cone(soil))
    for tool in list(dig_cycle())[:LIFTED]:
        soil.step(TICK_S, tool)
    return soil.payload_mass_kg


def test_a_spill_falls_under_the_spilling_edge_and_then_lies_on_the_ground():
    soil = Soil(fidelity="fast", container=TARGET_BOX)
    filled(soil)
    edge = np.array([-0.9, 0.0, 2.0])
    carried = tool_at(edge, math.radians(-180), np.zeros(3), 0.0)
    for _ in range(150):
        soil.step(TICK_S, carried)  # let the trench and what fell beside the bucket come to rest
    held, ground = soil.payload_mass_kg, soil.ledger_kg()["grid"]
    falling = []
    for pitch in np.radians(np.linspace(-180, -120, 120)):
        soil.step(TICK_S, tool_at(edge, pitch, np.zeros(3), math.radians(60) / 2.4))
        below = soil.parcel_positions_w[~soil.parcel_is_load]
        falling.append(below[(below[:, 2] < 1.9) & (below[:, 2] > 1.5)])
    points = np.concatenate(falling)
    assert len(points) > 10
    assert points[:, 0].mean() == pytest.approx(edge[0], abs=0.25)
    assert np.percentile(np.abs(points[:, 1]), 90) < 0.36 + 0.2
    still = tool_at(edge, math.radians(-120), np.zeros(3), 0.0)
    for _ in range(400):
        soil.step(TICK_S, still)
    lost = held - soil.payload_mass_kg
    assert lost > 20.0
    assert soil.airborne_mass_kg < 0.1 * lost
    landed = soil.ledger_kg()["grid"] - ground + soil.ledger_kg()["out_of_bounds"]
    assert landed == pytest.approx(lost - soil.airborne_mass_kg, abs=3 * soil.parcel_mass_kg)


def test_a_full_bucket_takes_no_more_and_pushes_a_heap_before_it():
    soil = Soil(fidelity="fast", container=TARGET_BOX)
    soil.reset(np.full((120, 120), 0.8))
    most = 0.0
    for tick in range(250):
        edge = np.array([1.5 - 0.012 * tick, 0.0, 0.3])
        tool = tool_at(edge, math.radians(-115), np.array([-0.6, 0.0, 0.0]), 0.0)
        soil.step(TICK_S, tool)
        most = max(most, soil.payload_mass_kg)
    heaped = heaped_volume_m3(tool.geometry, soil.parameters.slope_tan)
    # Loose parcels that lie before it still flow in by themselves.
    assert 0.9 <= most / (heaped * soil.density_kg_m3) <= 1.1
    i = int(np.argmin(np.abs(soil.x_w - edge[0]))) - 4
    assert soil.heights_m[i, 60] > 0.85


def test_the_benchmark_reports_a_plausible_cycle():
    report = real_time_factor(seed=1)
    assert 0.0 < report["p50_ms"] <= report["p95_ms"] <= report["worst_ms"]
    assert report["real_time_factor"] == pytest.approx(20.0 / report["mean_ms"])
    assert 0.0 < report["mean_awake"] <= report["mean_parcels"] <= report["most_parcels"] < 1500
    assert report["most_awake"] <= report["most_parcels"]
    assert 420.0 <= report["retained_mass_kg"] <= 550.0
