"""The safety table of the machine, a test for every row."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.testbed.protocol import RATE_HZ, Command, CommandFlag, Refusal
from lerobot_excav.testbed.safety import GATE_SAMPLES, STALE_S, WATCHDOG_S, Limits, SafetyGate

RANGE, ACCEL = np.array([[-1.0, 1.0]] * 4), np.full(4, 0.5)
FREE = np.zeros(4)
TICK_S = 1.0 / RATE_HZ
FULL, STILL = (1.0, -1.0, 0.5, 0.0), (0.0, 0.0, 0.0, 0.0)
HELD, STOP, RELEASE = CommandFlag.DEAD_MAN, CommandFlag.EMERGENCY_STOP, CommandFlag.RELEASE


class Wire:
    """A host that sends a command every tick, and the machine's gate behind it."""

    def __init__(self, **limits):
        self.log = []
        limits = Limits(joint_range_rad=RANGE, joint_accel_rad_s2=ACCEL, **{"soak_s": 0.0, **limits})
        self.gate = SafetyGate(limits, log=self.log.append)
        self.now_s, self.number, self.session = 100.0, 0, 1
        self.clock_s = 37.0  # by which the host's clock is behind

    def send(self, axes, flags=CommandFlag.NONE, *, age_us=0, way_s=0.0):
        self.number += 1
        host_us = round((self.now_s - way_s - self.clock_s) * 1e6)
        numbers = {"session": self.session, "number": self.number, "host_us": host_us, "age_us": age_us}
        return self.gate.hear(Command(axes=axes, flags=flags, **numbers), self.now_s)

    def tick(self, axes=STILL, flags=CommandFlag.NONE, *, joint_pos=FREE, joint_vel=FREE, is_sent=True, **sent):
        self.now_s += TICK_S
        if is_sent:
            self.send(axes, flags, **sent)
        return self.gate.tick(np.asarray(joint_pos, float), np.asarray(joint_vel, float), self.now_s, TICK_S)

    def armed(self):
        for _ in range(GATE_SAMPLES + 1):
            self.tick()
        assert self.gate.is_armed
        return self


def test_armed_and_with_the_dead_man_held_it_moves_as_told():
    verdict = Wire().armed().tick(FULL, HELD)
    assert (verdict.axes, verdict.refusal) == (FULL, Refusal.NONE)


@pytest.mark.parametrize("refused", [{"axes": FULL, "flags": CommandFlag.NONE}, {"axes": (0.0,) * 4, "flags": HELD}])
def test_the_start_gate_wants_ten_samples_in_a_row_with_sticks_centred_and_the_dead_man_let_go(refused):
    wire = Wire()
    for _ in range(3):  # whatever interrupts the row begins it again
        for _ in range(GATE_SAMPLES - 1):
            wire.tick()
        assert wire.tick(**refused).refusal is Refusal.START_GATE
    assert wire.tick(FULL, HELD).refusal is Refusal.START_GATE
    assert wire.armed().tick(FULL, HELD).refusal is Refusal.NONE


def test_the_dead_man_has_to_be_held_in_every_sample():
    wire = Wire().armed()
    assert wire.tick(FULL, HELD).axes == FULL
    assert wire.tick(FULL).axes == (0.0,) * 4
    assert wire.log[-1] is Refusal.DEAD_MAN
    assert wire.tick(FULL, HELD).axes == FULL  # let go is not lost


@pytest.mark.parametrize(
    ("age_s", "silent_ticks", "moves"),
    [(0.0, 0, True), (0.14, 0, True), (0.16, 0, False), (0.0, 7, True), (0.0, 8, False), (0.1, 3, False)],
)
def test_a_command_that_is_older_than_150_ms_counts_as_zero_wherever_it_got_old(age_s, silent_ticks, moves):
    assert STALE_S == 0.15
    wire = Wire().armed()
    verdict = wire.tick(FULL, HELD, age_us=round(age_s * 1e6))
    for _ in range(silent_ticks):
        verdict = wire.tick(is_sent=False)
    assert verdict.refusal is (Refusal.NONE if moves else Refusal.STALE)
    assert (verdict.axes == FULL) is moves


def test_after_half_a_second_of_silence_the_link_is_lost_and_the_gate_is_asked_again():
    wire = Wire().armed()
    for _ in range(round(WATCHDOG_S / TICK_S) + 1):
        verdict = wire.tick(is_sent=False)
    assert verdict.refusal is Refusal.NOT_HEARD
    assert wire.tick(FULL, HELD).refusal is Refusal.START_GATE
    assert wire.armed().tick(FULL, HELD).axes == FULL


def test_a_host_that_starts_again_is_asked_for_the_gate_too_however_quickly():
    wire = Wire().armed()
    wire.tick(FULL, HELD)
    wire.session, wire.number = 2, 0
    assert wire.tick(FULL, HELD).refusal is Refusal.START_GATE


def test_datagrams_that_come_twice_or_late_change_nothing():
    wire = Wire().armed()
    wire.tick(FULL, HELD)
    for number in (1, wire.number):
        late = Command(session=1, number=number, host_us=0, axes=(-1.0,) * 4, flags=HELD)
        assert not wire.gate.hear(late, wire.now_s)
    assert wire.gate.tick(FREE, FREE, wire.now_s, TICK_S).axes == FULL


def test_nothing_moves_until_thirty_seconds_of_zero_commands_have_been_watched_once():
    wire = Wire(soak_s=30.0)
    for tick in range(30 * RATE_HZ):
        assert wire.tick().refusal is Refusal.SOAK, tick
        if tick == 100:  # a stick that is moved begins it again
            wire.tick(FULL)
    for _ in range(105):
        wire.tick()
    assert wire.tick(FULL, HELD).refusal is Refusal.NONE
    for _ in range(50):
        wire.tick(is_sent=False)
    assert wire.armed().tick(FULL, HELD).refusal is Refusal.NONE  # of the first run only


def test_the_emergency_stop_latches_until_it_is_released_with_everything_let_go():
    wire = Wire().armed()
    assert wire.tick(FULL, HELD | STOP).axes == (0.0,) * 4
    for flags in (HELD, CommandFlag.NONE, HELD | RELEASE):
        assert wire.tick(FULL, flags).refusal is Refusal.EMERGENCY_STOP
    wire.session, wire.number = 9, 0  # a host that starts again does not release it either
    assert wire.tick().refusal is Refusal.EMERGENCY_STOP
    assert wire.tick(FULL, RELEASE).refusal is Refusal.EMERGENCY_STOP
    assert wire.tick(flags=RELEASE).refusal is Refusal.START_GATE
    assert wire.armed().tick(FULL, HELD).axes == FULL


def test_a_release_that_was_asked_for_before_the_stop_does_not_release_it():
    wire = Wire().armed()
    for _ in range(5):
        wire.tick(flags=RELEASE)
    wire.gate.is_stopped = True  # by a switch on the machine itself
    wire.send(STILL, STOP | RELEASE)
    for _ in range(50):
        assert wire.tick(flags=RELEASE).refusal is Refusal.EMERGENCY_STOP
    wire.tick()
    assert wire.tick(flags=RELEASE).refusal is not Refusal.EMERGENCY_STOP


def test_of_two_hosts_one_may_stop_and_a_wish_of_the_other_from_before_releases_nothing():
    wire = Wire().armed()
    driver, numbers = wire.session, {wire.session: wire.number, 77: 0}

    def say(session, *what):
        wire.session, wire.number = session, numbers[session]
        verdict = wire.tick(*what)
        numbers[session] = wire.number
        return verdict.refusal

    say(driver, STILL, RELEASE)  # nothing is latched; the wish stays
    for _ in range(20):
        assert say(77, STILL, STOP) is Refusal.EMERGENCY_STOP
        assert say(driver, STILL, RELEASE) is Refusal.EMERGENCY_STOP
    assert say(driver, FULL, HELD) is Refusal.EMERGENCY_STOP
    assert say(driver, STILL, RELEASE) is Refusal.START_GATE  # a wish from after the stop does


def test_a_datagram_that_was_overtaken_does_not_pass_because_another_host_spoke():
    wire = Wire().armed()
    driver, late = wire.session, wire.number + 1
    wire.number += 5
    wire.tick()
    wire.session, wire.number = 77, 0
    wire.tick(flags=STOP)
    wire.session, wire.number = driver, late - 1
    assert not wire.send(STILL, RELEASE)


@pytest.mark.parametrize(("late_s", "moves"), [(0.1, True), (0.2, False), (2.0, False)])
def test_a_command_that_was_under_way_for_longer_than_others_is_stale(late_s, moves):
    wire = Wire().armed()
    assert wire.tick(FULL, HELD, way_s=0.05).axes == FULL
    assert (wire.tick(FULL, HELD, way_s=late_s).axes == FULL) is moves
    assert wire.tick(FULL, HELD).axes == FULL


def test_clocks_that_drift_apart_do_not_make_commands_stale():
    wire = Wire().armed()
    for _ in range(5 * 60 * RATE_HZ):
        wire.clock_s += 2e-4 * TICK_S  # four times the drift of a bad crystal, each way
        verdict = wire.tick(FULL, HELD)
    assert verdict.refusal is Refusal.NONE
    wire.clock_s -= 0.1
    assert wire.tick(FULL, HELD).refusal is Refusal.NONE


def test_the_machine_is_never_faster_than_allowed():
    wire = Wire(speed=0.4).armed()
    verdict = wire.tick(FULL, HELD)
    assert verdict.axes == (0.4, -0.4, 0.4, 0.0)
    assert verdict.refusal is Refusal.SPEED_LIMIT
    assert wire.tick((0.3, 0.0, 0.0, 0.0), HELD).refusal is Refusal.NONE


@pytest.mark.parametrize("axis", range(4))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_at_its_limit_a_joint_moves_back_only_and_the_others_move_on(axis, side):
    wire, joint_pos, out = Wire().armed(), np.zeros(4), np.full(4, 0.5)
    joint_pos[axis], out[axis] = 0.99 * side, side
    verdict = wire.tick(tuple(out), HELD, joint_pos=joint_pos)
    assert verdict.axes[axis] == 0.0
    assert verdict.refusal is Refusal.JOINT_LIMIT
    assert sum(value == 0.5 for value in verdict.axes) == 3
    out[axis] = -side
    assert wire.tick(tuple(out), HELD, joint_pos=joint_pos).axes == tuple(out)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_fast_joint_is_stopped_before_its_limit_so_that_it_can_brake(side):
    wire = Wire().armed()
    told, joint_vel = (side, 0.0, 0.0, 0.0), np.array([0.8 * side, 0.0, 0.0, 0.0])  # brakes for 0.64 rad
    for at, moves in ((0.2, True), (0.3, True), (0.4, False)):
        verdict = wire.tick(told, HELD, joint_pos=[at * side, 0.0, 0.0, 0.0], joint_vel=joint_vel)
        assert (verdict.axes == told) is moves, at
    back = tuple(-value for value in told)
    assert wire.tick(back, HELD, joint_pos=[0.9 * side, 0.0, 0.0, 0.0], joint_vel=joint_vel).axes == back


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("told", [-1.0, 1.0])
def test_a_joint_whose_sensor_gives_no_number_stands_still(value, told):
    wire, joint_pos = Wire().armed(), np.zeros(4)
    joint_pos[2] = value
    verdict = wire.tick((told, told, told, 0.0), HELD, joint_pos=joint_pos)
    assert verdict.axes == (told, told, 0.0, 0.0)
    assert verdict.refusal is Refusal.JOINT_LIMIT


def test_a_stick_that_moves_between_two_ticks_begins_the_soak_again():
    wire = Wire(soak_s=1.0)
    for _ in range(40):
        wire.tick()
    for axes in (FULL, STILL):
        wire.send(axes)
    for _ in range(45):
        assert wire.tick().refusal is Refusal.SOAK


def test_every_change_of_the_reason_is_logged_once():
    wire = Wire().armed()
    for _ in range(5):
        wire.tick(FULL)
    wire.tick(FULL, HELD)
    assert wire.log == [Refusal.START_GATE, Refusal.DEAD_MAN, Refusal.NONE]


STEPS = st.tuples(
    st.sampled_from([FULL, (0.0,) * 4]),
    st.integers(0, 7),
    st.sampled_from([0, 0, 200_000]),
    st.booleans(),
    st.sampled_from([0, 0, 0, 1]),
)


@given(st.lists(STEPS, max_size=60))
def test_whatever_comes_it_moves_only_when_armed_held_fresh_and_not_stopped(steps):
    """Two hosts speak; a stop lasts until one says release that was heard without that word since."""
    wire, silent_s = Wire().armed(), 0.0
    sessions, numbers = (wire.session, 77), {wire.session: wire.number, 77: 0}
    is_stopped, may_release = False, set()
    for axes, number, age_us, is_sent, host in steps:
        flags, session = CommandFlag(number), sessions[host]
        wire.session, wire.number = session, numbers[session]
        verdict = wire.tick(axes, flags, age_us=age_us, is_sent=is_sent)
        numbers[session] = wire.number
        silent_s = 0.0 if is_sent else silent_s + TICK_S
        if is_sent and flags & STOP:
            is_stopped, may_release = True, set()
        if is_sent and not flags & RELEASE:
            may_release.add(session)
        elif is_sent and not flags & STOP and session in may_release:
            is_stopped = is_stopped and (any(axes) or bool(flags & HELD))
        assert wire.gate.is_stopped == is_stopped
        if any(verdict.axes):
            assert not is_stopped
            assert silent_s + 1e-6 * wire.gate.command.age_us <= STALE_S + 1e-9
            assert wire.gate.is_armed
            assert not wire.gate.is_stopped
            assert wire.gate.command.flags & HELD
            assert wire.gate.command.age_us <= 150_000
