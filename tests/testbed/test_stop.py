"""A second program stops a machine that a first one drives."""

import threading
import time

import pytest

from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.scripts import main, testbed_stop
from lerobot_excav.testbed.host_link import HostLink
from lerobot_excav.testbed.protocol import CommandFlag, Refusal, StateFlag
from lerobot_excav.testbed.safety import STILL

from .conftest import emulated, linked, until

LEFT = (1.0, 0.0, 0.0, 0.0)


def address_of(served):
    return "{}:{}".format(*served.emulator.address)


def driven(link):
    """Drive to the left until the machine does it."""
    link.let_go(lets_go=True)
    until(lambda: link.heard().state.flags & StateFlag.ARMED)
    link.let_go(lets_go=False)
    until(lambda: link.give(LEFT) or link.heard().state.joint_vel[0] > 0.05)


@pytest.mark.parametrize("wishes", [False, True], ids=["plain", "with a release that is still wished for"])
def test_a_machine_that_is_driven_is_stopped_from_elsewhere_until_it_is_released(capsys, wishes):
    with emulated() as served, linked(served) as link:
        until(lambda: link.counts["heard"] > 0)
        if wishes:  # that the machine has heard before the stop, and that it goes on hearing
            served.emulator.gate.is_stopped = True
            link.let_go(lets_go=False)
            link.release()  # with the dead-man held, so that it is in vain
            until(lambda: served.emulator.gate.command.flags & CommandFlag.RELEASE)
        else:
            driven(link)
        assert testbed_stop.run(testbed_stop.ARGUMENTS(address=address_of(served))) == 0
        assert "is stopped, and stays so" in capsys.readouterr().out
        link.let_go(lets_go=wishes)  # whatever a release needs, but that it is from before
        axes = STILL if wishes else LEFT
        until(lambda: link.give(axes) or abs(link.heard().state.joint_vel[0]) < 0.01)
        swing_rad = link.heard().state.joint_pos[0]
        for _ in range(20):
            time.sleep(0.03)
            link.give(axes)
            state = link.heard().state  # the driver is answered all the while
            assert state.flags & StateFlag.STOP_LATCHED
            assert state.refusal is Refusal.EMERGENCY_STOP
        assert abs(state.joint_pos[0] - swing_rad) < 0.01
        link.let_go(lets_go=True)
        link.give(STILL)
        link.release()
        until(lambda: not link.heard().state.flags & StateFlag.STOP_LATCHED)
        driven(link)


def test_it_goes_on_until_a_machine_that_was_away_says_that_it_is_stopped(monkeypatch, capsys):
    monkeypatch.setattr(testbed_stop, "PATIENCE_S", 0.1)
    codes, attempts, attempt, is_over = [], [], testbed_stop._attempt, threading.Event()

    def first_to_nobody(address):
        attempts.append(address)
        return None if is_over.is_set() else attempt("127.0.0.1:9" if len(attempts) < 3 else address)

    monkeypatch.setattr(testbed_stop, "_attempt", first_to_nobody)
    with emulated() as served:
        arguments = testbed_stop.ARGUMENTS(address=address_of(served))
        thread = threading.Thread(target=lambda: codes.append(testbed_stop.run(arguments)), daemon=True)
        thread.start()
        thread.join(timeout=20.0)
        is_over.set()
        assert codes == [0]
        assert served.emulator.gate.is_stopped
    assert len(attempts) >= 3
    assert capsys.readouterr().err.count("DOES NOT SAY THAT IT IS STOPPED") == len(attempts) - 1


def test_where_there_is_no_way_it_is_tried_again_at_once_and_said(monkeypatch):
    tries = []

    def connect(link):
        tries.append(link)
        raise DeviceError("no way") from OSError("no route to host")

    monkeypatch.setattr(HostLink, "connect", connect)
    monkeypatch.setattr(testbed_stop, "PATIENCE_S", 0.3)
    assert testbed_stop._attempt("127.0.0.1:9") == "no way"
    assert len(tries) > 3


def test_other_packages_have_no_part_in_a_stop(monkeypatch):
    def fail():
        raise AssertionError("plugins were loaded")

    monkeypatch.setattr("lerobot_excav.envs.plugins.load_plugins", fail)
    monkeypatch.setattr(testbed_stop, "_attempt", lambda address: None)
    assert main.main(["testbed-stop"]) == 0


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ConfigurationError, match="--address='machine' is not an address and a port"):
        testbed_stop.ARGUMENTS(address="machine")
