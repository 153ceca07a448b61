import math

import numpy as np
import pytest

from lerobot_excav.envs.soil.benchmark import BOX, TICK_S, cone, dig_cycle, real_time_factor, tool_at
from lerobot_excav.envs.soil.soil import Soil
from lerobot_excav.envs.soil.spilling import MAX_PARCELS
from lerobot_excav.envs.soil.tool import Reaction

CARRIED = 350
"""Ticks until the load is lifted clear of the pile."""


@pytest.fixture(scope="module")
def cycle() -> tuple[Soil, list[Reaction], list[dict[str, float]]]:
    soil = Soil(container=BOX)
    soil.reset(cone(soil))
    reactions, ledgers = [], []
    for tool in dig_cycle():
        reactions.append(soil.step(TICK_S, tool))
        ledgers.append(soil.ledger_kg())
    return soil, reactions, ledgers


Cycle = tuple[Soil, list[Reaction], list[dict[str, float]]]


def test_the_bucket_fills_as_an_operator_fills_it(cycle: Cycle) -> None:
    assert 400.0 <= cycle[2][CARRIED]["bucket"] <= 500.0


def test_nothing_is_lost_on_the_way_to_the_box(cycle: Cycle) -> None:
    assert cycle[2][CARRIED + 145]["bucket"] == pytest.approx(cycle[2][CARRIED]["bucket"], abs=1.0)


def test_the_dump_empties_the_bucket_into_the_box(cycle: Cycle) -> None:
    assert cycle[2][-1]["bucket"] < 20.0
    assert cycle[2][-1]["box"] > 0.98 * cycle[2][CARRIED]["bucket"]
    assert cycle[2][-1]["parcels"] == 0.0


def test_the_dump_takes_about_a_second(cycle: Cycle) -> None:
    held = np.array([ledger["bucket"] for ledger in cycle[2]])
    start = np.flatnonzero(held > 0.95 * held[CARRIED])[-1]
    end = np.flatnonzero(held > 0.05 * held[CARRIED])[-1]
    assert 0.5 <= (end - start) * TICK_S <= 1.5


def test_the_pile_lost_what_the_box_gained(cycle: Cycle) -> None:
    first, last = cycle[2][0], cycle[2][-1]
    assert first["grid"] - last["grid"] == pytest.approx(
        last["box"] + last["bucket"] + last["out_of_bounds"], abs=1e-6
    )


def test_digging_meets_resistance_and_carrying_none(cycle: Cycle) -> None:
    forces = np.array([np.linalg.norm(reaction.force_w_n) for reaction in cycle[1]])
    assert 2e3 < forces[100:200].mean() < 40e3
    assert not forces[CARRIED:].any()


def test_the_payload_sits_low_in_the_carried_bucket(cycle: Cycle) -> None:
    com = cycle[1][CARRIED].payload_com_t
    assert 0.3 < com[0] < 0.9
    assert com[1] == 0.0
    assert 0.05 < com[2] < 0.35


def filled(soil: Soil) -> float:
    soil.reset(cone(soil))
    for tool in list(dig_cycle())[:CARRIED]:
        soil.step(TICK_S, tool)
    return soil.payload_mass_kg


def test_a_spill_falls_under_the_spilling_edge() -> None:
    soil = Soil(container=BOX)
    filled(soil)
    for _ in range(400):
        soil.step()  # let the trench come to rest
    grid = soil.heights_m.copy()
    edge = np.array([-0.9, 0.0, 2.0])
    for pitch in np.radians(np.linspace(-180, -140, 60)):
        soil.step(TICK_S, tool_at(edge, pitch, np.zeros(3), 0.0))
    assert len(soil.parcel_positions_w) > 0
    assert np.abs(soil.parcel_positions_w[:, 1]).max() < 0.36 + 0.2
    while len(soil.parcel_positions_w):
        soil.step()
    gain = (soil.heights_m - grid).clip(0.0)
    assert (gain.sum(axis=1) @ soil.x_w) / gain.sum() == pytest.approx(edge[0], abs=0.25)
    assert (gain.sum(axis=0) @ soil.y_w) / gain.sum() == pytest.approx(0.0, abs=0.1)


def test_overflow_of_a_buried_bucket_goes_back_to_the_ground() -> None:
    soil = Soil(container=BOX)
    soil.reset(np.full((120, 120), 0.8))
    for tick in range(250):
        edge = np.array([1.5 - 0.012 * tick, 0.0, 0.3])
        soil.step(TICK_S, tool_at(edge, math.radians(-115), np.array([-0.6, 0.0, 0.0]), 0.0))
        assert len(soil.parcel_positions_w) == 0
    i = int(np.argmin(np.abs(soil.x_w - edge[0]))) - 4
    assert soil.heights_m[i, 60] > 0.85  # a heap before the full bucket


def test_parcels_in_the_air_are_bounded_and_heavier_instead() -> None:
    soil = Soil(container=BOX)
    mass = filled(soil)
    high = np.tile([0.0, 0.0, 90.0], (MAX_PARCELS - 3, 1)) + np.random.default_rng(0).normal(
        0, 0.1, (MAX_PARCELS - 3, 3)
    )
    soil.add_parcels(high, np.zeros_like(high))
    total = sum(soil.ledger_kg().values())
    edge = np.array([-0.9, 0.0, 2.0])
    count = 0
    for pitch in np.radians(np.linspace(-180, -60, 20)):
        soil.step(TICK_S, tool_at(edge, pitch, np.zeros(3), 0.0))
        count = max(count, len(soil.parcel_positions_w))
        assert sum(soil.ledger_kg().values()) == pytest.approx(total, abs=1e-6)
    assert count <= MAX_PARCELS + 20
    assert soil.payload_mass_kg < 0.8 * mass


def test_the_benchmark_reports_a_plausible_cycle() -> None:
    report = real_time_factor(seed=1)
    assert set(report) == {"real_time_factor", "mean_ms", "p95_ms", "worst_ms", "idle_ms", "retained_mass_kg"}
    assert 400.0 <= report["retained_mass_kg"] <= 500.0
