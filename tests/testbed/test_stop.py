"""A second program stops a machine that a first one drives."""

import pytest

from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.scripts import testbed_stop
from lerobot_excav.testbed.protocol import Refusal, StateFlag

from .conftest import emulated, linked, until

LEFT = (1.0, 0.0, 0.0, 0.0)


def addressed(served):
    return testbed_stop.ARGUMENTS(address="{}:{}".format(*served.emulator.address))


def driven(link):
    """Drive to the left until the machine does it."""
    link.let_go(lets_go=True)
    until(lambda: link.heard().state.flags & StateFlag.ARMED)
    link.let_go(lets_go=False)
    until(lambda: link.give(LEFT) or link.heard().state.joint_vel[0] > 0.05)


@pytest.mark.slow
def test_a_machine_that_is_driven_is_stopped_from_elsewhere_until_it_is_released(capsys):
    with emulated() as served, linked(served) as link:
        until(lambda: served.emulator.address and link.counts["heard"] > 0)
        driven(link)
        assert testbed_stop.run(addressed(served)) == 0
        assert "is stopped, and stays so" in capsys.readouterr().out
        until(lambda: link.give(LEFT) or abs(link.heard().state.joint_vel[0]) < 0.01)
        for _ in range(20):
            link.give(LEFT)
            state = link.heard().state
            assert state.flags & StateFlag.STOP_LATCHED
            assert state.refusal is Refusal.EMERGENCY_STOP
        link.let_go(lets_go=True)
        link.give((0.0, 0.0, 0.0, 0.0))
        link.release()
        until(lambda: not link.heard().state.flags & StateFlag.STOP_LATCHED)
        driven(link)


def test_a_machine_that_does_not_answer_is_named_and_the_wired_stop_recommended(monkeypatch):
    monkeypatch.setattr(testbed_stop, "PATIENCE_S", 0.1)
    with pytest.raises(DeviceError, match=r"127\.0\.0\.1:9 did not say .* wired"):
        testbed_stop.run(testbed_stop.ARGUMENTS(address="127.0.0.1:9"))


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ConfigurationError, match="--address='machine' is not an address and a port"):
        testbed_stop.ARGUMENTS(address="machine")
