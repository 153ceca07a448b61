"""What keeps a machine still, row by row of the table, over a real socket and with the simulated machine moving."""

import time

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.constants import JOINT_RANGE_RAD
from lerobot_excav.testbed.protocol import Refusal, StateFlag
from lerobot_excav.testbed.safety import GATE_SAMPLES, STALE_S, STILL, WATCHDOG_S

from .conftest import emulated, linked, until

pytestmark = pytest.mark.slow

LEFT = (1.0, 0.0, 0.0, 0.0)
ARM_IN = (0.0, 0.0, -1.0, 0.0)
STANDS_RAD_S = 0.02


class Switch:
    """A dead-man that a test holds and lets go."""

    is_down = False

    def is_held(self):
        return self.is_down


@pytest.fixture
def switch():
    return Switch()


def state(link):
    return link.heard().state


def arm(link, switch):
    """Pass the start gate as a person does: everything let go, then the dead-man held."""
    until(lambda: link.counts["heard"] > 5)
    switch.is_down = False
    link.give(STILL)
    until(lambda: state(link).flags & StateFlag.ARMED)
    switch.is_down = True


def drive(link, axes, condition, limit_s=10.0):
    """Go on commanding until something is so."""
    until(lambda: link.give(axes) or condition(), limit_s)


def watch(link, axes, seconds):
    """Go on commanding; return all states that were heard meanwhile."""
    seen, end_s = [], time.monotonic() + seconds
    while time.monotonic() < end_s:
        link.give(axes)
        seen.append(state(link))
        time.sleep(0.02)
    return seen


def is_turning(link):
    return abs(state(link).joint_vel[0]) > 0.05


def begin_to_turn(link, switch):
    """Pass the start gate, and swing until the machine does."""
    arm(link, switch)
    drive(link, LEFT, lambda: is_turning(link))


def stands(link):
    return abs(state(link).joint_vel[0]) < STANDS_RAD_S


def test_soak_it_stands_until_zero_commands_were_watched_for_the_whole_time_and_a_stick_begins_it_again(switch):
    with emulated(soak_s=1.5) as served, linked(served, switch) as link:
        until(lambda: link.counts["heard"] > 5)
        assert {each.refusal for each in watch(link, STILL, 0.8)} == {Refusal.SOAK}
        assert all(not each.flags & StateFlag.ARMED for each in watch(link, LEFT, 0.3))
        began_s = time.monotonic()
        link.give(STILL)
        until(lambda: state(link).refusal is not Refusal.SOAK)
        assert time.monotonic() - began_s > 1.2  # all of it again
        begin_to_turn(link, switch)


def test_start_gate_a_stick_that_is_held_over_from_the_start_moves_nothing(switch):
    with emulated() as served, linked(served, switch) as link:
        until(lambda: link.counts["heard"] > 5)
        seen = watch(link, LEFT, 1.0)
        assert len(seen) > GATE_SAMPLES
        assert {each.refusal for each in seen[5:]} == {Refusal.START_GATE}
        assert max(abs(each.joint_vel[0]) for each in seen) < STANDS_RAD_S
        begin_to_turn(link, switch)


def test_dead_man_letting_go_stops_it_while_the_stick_stays_and_holding_it_again_goes_on(switch):
    with emulated() as served, linked(served, switch) as link:
        begin_to_turn(link, switch)
        switch.is_down = False
        drive(link, LEFT, lambda: state(link).refusal is Refusal.DEAD_MAN and stands(link))
        still = state(link).joint_pos[0]
        assert abs(watch(link, LEFT, 0.5)[-1].joint_pos[0] - still) < 0.02
        switch.is_down = True
        drive(link, LEFT, lambda: is_turning(link))


def test_speed_limit_of_the_machine_holds_whatever_is_commanded(switch):
    fastest = {}
    for limit in (1.0, 0.3):
        with emulated(speed_limit=limit) as served, linked(served, switch) as link:
            arm(link, switch)
            seen = watch(link, LEFT, 2.5)
            fastest[limit] = max(abs(each.joint_vel[0]) for each in seen)
            assert (Refusal.SPEED_LIMIT in {each.refusal for each in seen}) is (limit < 1.0)
    assert fastest[0.3] < 0.4 * fastest[1.0]
    assert fastest[0.3] > 0.05


def test_joint_limits_it_brakes_before_the_end_of_its_range_and_moves_back(switch):
    with emulated() as served, linked(served, switch) as link:
        least, most = np.array(JOINT_RANGE_RAD)[2]
        arm(link, switch)
        drive(link, ARM_IN, lambda: state(link).refusal is Refusal.JOINT_LIMIT, limit_s=30.0)
        seen = watch(link, ARM_IN, 1.0)
        assert all(least - 0.01 < each.joint_pos[2] < most + 0.01 for each in seen)
        assert abs(seen[-1].joint_vel[2]) < STANDS_RAD_S
        drive(link, tuple(-axis for axis in ARM_IN), lambda: abs(state(link).joint_vel[2]) > 0.05)


def test_staleness_a_command_that_is_not_renewed_counts_as_zero(switch):
    with emulated() as served, linked(served, switch, hold_s=60.0) as link:  # a host that holds what it was told
        begin_to_turn(link, switch)
        link.give(LEFT)
        given_s = time.monotonic()
        until(lambda: state(link).refusal is Refusal.STALE)
        assert time.monotonic() - given_s < 10.0 * STALE_S
        until(lambda: stands(link))


def test_link_watchdog_silence_stops_it_and_the_start_gate_is_asked_again(switch, monkeypatch):
    with emulated() as served, linked(served, switch) as link:
        begin_to_turn(link, switch)
        monkeypatch.setattr(link, "_send", lambda: None)
        until(lambda: Refusal.NOT_HEARD in [refusal for _, refusal in served.emulator.refusals], 10.0 * WATCHDOG_S)
        monkeypatch.undo()
        drive(link, LEFT, lambda: state(link).refusal is Refusal.START_GATE and stands(link))
        begin_to_turn(link, switch)


def test_emergency_stop_is_latched_whatever_follows_and_released_with_everything_let_go(switch):
    with emulated() as served, linked(served, switch) as link:
        begin_to_turn(link, switch)
        link.stop()
        drive(link, LEFT, lambda: state(link).refusal is Refusal.EMERGENCY_STOP and stands(link))
        link.release()  # with the dead-man held and the stick over: in vain
        assert all(each.flags & StateFlag.STOP_LATCHED for each in watch(link, LEFT, 0.5))
        switch.is_down = False
        link.give(STILL)
        until(lambda: not state(link).flags & StateFlag.STOP_LATCHED)


def test_a_machine_that_starts_again_at_its_address_asks_for_the_start_gate(switch):
    with emulated() as served:
        port = served.emulator.address[1]
        with linked(served, switch) as link:
            begin_to_turn(link, switch)
            served.stop()
            with emulated(port=port):
                until(lambda: _is_refused(link, Refusal.START_GATE))
                assert all(abs(each.joint_vel[0]) < STANDS_RAD_S for each in watch(link, LEFT, 0.3))
                begin_to_turn(link, switch)


@pytest.mark.parametrize("jump_s", [3600.0, -3600.0])
def test_a_clock_of_the_host_that_jumps_back_stops_it_as_a_late_command_does_and_one_that_jumps_ahead_does_not(
    switch, jump_s
):
    jumped_us = [0]

    def clock_us():
        return time.perf_counter_ns() // 1000 + 7_200_000_000 + jumped_us[0]

    with emulated() as served, linked(served, switch, clock_us=clock_us) as link:
        machine = served.site._env.world.machine
        begin_to_turn(link, switch)
        jumped_us[0] = round(jump_s * 1e6)
        if jump_s < 0.0:
            drive(link, LEFT, lambda: abs(machine.joint_vel[0]) < STANDS_RAD_S)
            assert served.emulator.refusals[-1][1] is Refusal.STALE
        else:
            end_s = time.monotonic() + 1.0
            drive(link, LEFT, lambda: time.monotonic() > end_s)
            assert abs(machine.joint_vel[0]) > 0.05


def _is_refused(link, refusal):
    return link.counts["heard"] > 0 and link._heard.state.refusal is refusal
