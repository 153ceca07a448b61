"""Faults of the wire, valves, and clocks that differ."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.testbed.clock_offset import ClockOffset
from lerobot_excav.testbed.faulty_wire import FaultyWire, WireFaults
from lerobot_excav.testbed.valves import Valves


def arrivals(count=4000, **faults):
    """Send a number every 20 ms; return what arrived, and when."""
    wire = FaultyWire(WireFaults(**faults), np.random.default_rng(0))
    came = []
    for number in range(count + 100):
        now_s = 0.02 * number
        if number < count:
            wire.put(number.to_bytes(4, "big"), now_s)
        came += [(int.from_bytes(data, "big"), now_s) for data in wire.take(now_s)]
    return came


def test_a_good_wire_delivers_everything_at_once_in_order():
    assert arrivals(count=50) == [(number, pytest.approx(0.02 * number)) for number in range(50)]


def test_a_share_is_lost_and_a_share_comes_twice():
    numbers = [number for number, _ in arrivals(loss=0.2)]
    assert 0.77 < len(numbers) / 4000 < 0.83
    assert len(numbers) == len(set(numbers))
    doubled = [number for number, _ in arrivals(duplicates=0.3)]
    assert 1.27 < len(doubled) / 4000 < 1.33


def test_delay_is_the_least_and_jitter_comes_on_top_so_that_some_overtake_others():
    came = arrivals(delay_ms=50.0, jitter_ms=30.0)
    waits_ms = np.array([1e3 * (now_s - 0.02 * number) for number, now_s in came])
    assert waits_ms.min() >= 50.0
    assert 80.0 < waits_ms.mean() < 95.0  # it is looked at every 20 ms: ten more on the mean
    numbers = [number for number, _ in came]
    assert numbers != sorted(numbers)
    still = [number for number, _ in arrivals(delay_ms=50.0)]
    assert still == sorted(still)


@pytest.mark.parametrize("fault", [{"loss": 1.5}, {"delay_ms": -1.0}, {"jitter_ms": float("nan")}, {"duplicates": 2}])
def test_faults_that_cannot_be_are_refused(fault):
    with pytest.raises(ConfigurationError, match="of the wire is not possible"):
        WireFaults(**fault)


def test_valves_open_with_their_time_constant_and_not_within_the_dead_zone():
    valves, dt_s = Valves(lag_s=0.2, dead_zone=0.1), 0.02
    flows = np.array([valves.step(np.array([1.0, -1.0, 0.09, 0.55]), dt_s) for _ in range(100)])
    assert flows[9, 0] == pytest.approx(1.0 - np.exp(-1.0))  # after 0.2 s
    assert flows[:, 1] == pytest.approx(-flows[:, 0])
    assert not flows[:, 2].any()
    assert flows[-1, 3] == pytest.approx(0.5, abs=1e-3)  # half of what lies beyond the zone
    valves.reset()
    assert not valves.step(np.zeros(4), dt_s).any()
    assert Valves(lag_s=0.0, dead_zone=0.0).step(np.full(4, 0.3), dt_s) == pytest.approx(0.3)


@given(st.integers(-(10**12), 10**12), st.lists(st.tuples(st.integers(0, 50_000), st.integers(0, 50_000)), min_size=1))
def test_the_offset_of_a_clock_is_within_half_of_the_shortest_round_trip(offset_us, trips):
    clock, now_us = ClockOffset(), 10**13
    for there_us, back_us in trips:
        now_us += 20_000
        clock.note(
            sent_us=now_us,
            held_us=5_000,
            machine_us=now_us + there_us + 5_000 - offset_us,
            came_us=now_us + there_us + 5_000 + back_us,
        )
    assert abs(clock.offset_us - offset_us) <= clock.trip_us / 2 + 1
    assert clock.trip_us == min(there_us + back_us for there_us, back_us in trips)


def test_a_clock_that_was_set_is_believed_at_once():
    clock = ClockOffset()
    for number in range(20):
        clock.note(sent_us=number, held_us=0, machine_us=number, came_us=number + 100)
    clock.note(sent_us=50, held_us=0, machine_us=50 + 3_600_000_000, came_us=50 + 90_000)
    assert clock.offset_us == pytest.approx(-3_600_000_000, abs=50_000)
