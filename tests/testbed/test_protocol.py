"""Datagrams: bytes as the page says, round trips, and everything else refused."""

import struct
import zlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.testbed.protocol import (
    MOST_SESSIONS,
    Command,
    CommandFlag,
    DatagramError,
    Newest,
    Refusal,
    State,
    StateFlag,
)

SINGLE = st.floats(-1.0, 1.0, width=32)
U16, U32, U64 = (st.integers(0, 2**bits - 1) for bits in (16, 32, 64))
COMMANDS = st.builds(
    Command,
    session=U16,
    number=U32,
    host_us=U64,
    axes=st.tuples(SINGLE, SINGLE, SINGLE, SINGLE),
    age_us=U32,
    flags=st.sampled_from([CommandFlag(value) for value in range(8)]),
)
JOINTS = st.lists(st.floats(-99.0, 99.0, width=32), min_size=4, max_size=4).map(tuple)
STATES = st.builds(
    State,
    session=U16,
    number=U32,
    machine_us=U64,
    joint_pos=JOINTS,
    joint_vel=JOINTS,
    command_session=U16,
    command_number=U32,
    command_host_us=U64,
    command_age_us=U64,
    refusal=st.sampled_from(Refusal),
    flags=st.sampled_from([StateFlag(value) for value in range(8)]),
)


@given(COMMANDS)
def test_a_command_comes_back_as_it_was_sent(command):
    assert Command.decode(command.encode()) == command


@given(STATES)
def test_a_state_comes_back_as_it_was_sent(state):
    assert State.decode(state.encode()) == state


def test_the_bytes_of_a_command_lie_where_the_table_says():
    data = Command(
        session=0x0201, number=0x06050403, host_us=7, axes=(0.5, -1.0, 0.0, 0.25), age_us=9, flags=CommandFlag.DEAD_MAN
    ).encode()
    assert len(data) == 44
    assert data[:12] == b"EXC1" + bytes([1, 1, 1, 2, 3, 4, 5, 6])
    assert data[12:20] == bytes([7, 0, 0, 0, 0, 0, 0, 0])
    assert struct.unpack("<4f", data[20:36]) == (0.5, -1.0, 0.0, 0.25)
    assert data[36:40] == bytes([9, 0, 0, 0])
    assert struct.unpack("<I", data[40:]) == (zlib.crc32(data[:40]),)


def test_the_bytes_of_a_state_lie_where_the_table_says():
    joints = {"joint_pos": (1.0, 2.0, 3.0, 4.0), "joint_vel": (5.0, 6.0, 7.0, 8.0)}
    data = State(
        **{"session": 1, "number": 2, "machine_us": 3, "command_session": 4, "command_number": 5},
        **{"command_host_us": 6, "command_age_us": 7, "refusal": Refusal.STALE, "flags": StateFlag.ARMED},
        **joints,
    ).encode()
    assert len(data) == 80
    assert data[4:6] == bytes([2, 1])
    assert struct.unpack("<HHIQ", data[20:36]) == (4, Refusal.STALE, 5, 6)
    assert struct.unpack("<8f", data[36:68]) == (*joints["joint_pos"], *joints["joint_vel"])
    assert struct.unpack("<QI", data[68:]) == (7, zlib.crc32(data[:76]))


@given(COMMANDS, st.integers(0, 43), st.integers(1, 255))
def test_a_byte_that_changed_on_the_way_is_noticed(command, place, change):
    data = bytearray(command.encode())
    data[place] ^= change
    with pytest.raises(DatagramError):
        Command.decode(bytes(data))


@given(st.binary(max_size=100))
def test_nonsense_is_refused_in_words(data):
    for kind in (Command, State):
        with pytest.raises(DatagramError):
            kind.decode(data)


@pytest.mark.parametrize("axes", [(1.5, 0, 0, 0), (0, float("nan"), 0, 0), (0, 0, float("-inf"), 0)])
def test_commands_beyond_full_speed_are_refused_even_with_a_right_sum(axes):
    with pytest.raises(DatagramError, match="not within -1 and 1"):
        Command.decode(Command(session=1, number=1, host_us=0, axes=axes).encode())


@given(st.lists(st.integers(1, 30), max_size=40))
def test_of_numbers_that_come_in_any_order_only_new_ones_pass_and_they_rise(numbers):
    newest = Newest()
    passed = [number for number in numbers if newest.is_news(7, number)]
    assert passed == sorted(set(passed))
    assert max(numbers, default=0) == max(passed, default=0)
    assert newest.is_news(8, 1)  # whoever starts again counts from 1
    assert not newest.is_news(8, 1)


def test_sessions_may_alternate_and_each_has_its_own_numbers():
    newest = Newest()
    assert [newest.is_news(7, 5), newest.is_news(8, 1), newest.is_news(7, 5), newest.is_news(7, 6)] == [1, 1, 0, 1]
    assert newest.session == 7
    assert not newest.is_news(8, 1)
    assert newest.session == 7  # what is no news changes nothing
    for session in range(100, 100 + MOST_SESSIONS):
        assert newest.is_news(session, 1)
    assert newest.is_news(7, 1)  # forgotten; of so many at once none drives
    assert not newest.is_news(100 + MOST_SESSIONS - 1, 1)


def test_the_page_holds_the_tables_of_the_module():
    page = (Path(__file__).parents[2] / "docs/reference/testbed.md").read_text()
    import lerobot_excav.testbed.protocol as protocol

    rows = [line for line in protocol.__doc__.splitlines() if line.startswith("| ")]
    assert len(rows) > 20
    for row in rows:
        assert row in page
