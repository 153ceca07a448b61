import math
from typing import NamedTuple

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


class Cycle(NamedTuple):
    """What was seen at every tick."""

    reactions: list[Reaction]
    ledgers: list[dict[str, float]]
    awake: list[int]

    def held_kg(self, place: str) -> np.ndarray:
        return np.array([ledger[place] for ledger in self.ledgers])


@pytest.fixture(scope="module")
def cycle():
    soil, seen = Soil(container=TARGET_BOX), Cycle([], [], [])
    soil.reset(cone(soil))
    for tool in dig_cycle():
        seen.reactions.append(soil.step(TICK_S, tool))
        seen.ledgers.append(soil.ledger_kg())
        seen.awake.append(soil.awake_parcel_count)
    return seen


def test_the_bucket_fills_as_an_operator_fills_it_and_loses_next_to_nothing_of_its_sleeping_load(cycle):
    """The band of the experiment operator_cycle: 485 +- 65 kg."""
    held = cycle.held_kg("bucket")
    assert 420.0 <= held[LIFTED] <= 550.0
    assert held[OVER_BOX] == pytest.approx(held[LIFTED], rel=0.02)
    assert min(cycle.awake[LIFTED:OVER_BOX]) == 0
    com = cycle.reactions[LIFTED].payload_com_t  # low in the bucket
    assert 0.3 < com[0] < 0.9
    assert abs(com[1]) < 0.02
    assert 0.05 < com[2] < 0.35


def test_the_dump_empties_the_bucket_into_the_box_in_about_a_second(cycle):
    held, box, falling = (cycle.held_kg(place) for place in ("bucket", "box", "parcels"))
    assert (held[-1], falling[-1]) == (0.0, 0.0)
    assert box[-1] > 0.97 * held[LIFTED]
    start, end = (np.flatnonzero(held > share * held[LIFTED])[-1] for share in (0.95, 0.05))
    assert 0.5 <= (end - start) * TICK_S <= 1.5
    falling, box = falling[OVER_BOX:], box[OVER_BOX:]
    assert falling.max() > 0.5 * held[LIFTED]
    assert np.argmax(falling) < np.argmax(box > 0.5 * box[-1])  # soil falls before it is in the box


def test_digging_meets_resistance_and_carrying_none(cycle):
    forces = np.array([np.linalg.norm(reaction.force_w_n) for reaction in cycle.reactions])
    assert 2e3 < forces[100:200].mean() < 40e3
    assert not forces[LIFTED:].any()


def test_a_spill_falls_under_the_spilling_edge_and_then_lies_on_the_ground():
    soil = Soil(fidelity="fast", container=TARGET_BOX)
    soil.reset(cone(soil))
    for tool in list(dig_cycle())[:LIFTED]:
        soil.step(TICK_S, tool)
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


@pytest.mark.slow
def test_the_benchmark_reports_a_plausible_cycle():
    report = real_time_factor(seed=1)
    assert 0.0 < report["p50_ms"] <= report["p95_ms"] <= report["worst_ms"]
    assert report["real_time_factor"] == pytest.approx(20.0 / report["mean_ms"])
    assert 0.0 < report["mean_awake"] <= report["mean_parcels"] <= report["most_parcels"] < 1500
    assert report["most_awake"] <= report["most_parcels"]
    assert 420.0 <= report["retained_mass_kg"] <= 550.0
