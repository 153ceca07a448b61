"""The dead-man as a button: held, let go, pulled out, and not there."""

import sys
from types import SimpleNamespace

import pytest

from lerobot_excav.errors import DeviceError
from lerobot_excav.testbed.dead_man import GamepadButton


class FakePygame:
    """What is asked of pygame, with one device whose cable can be pulled."""

    class error(Exception):  # noqa: N801, N818 - its name there
        pass

    def __init__(self):
        self.pressed, self.is_plugged, self.is_over = False, True, False
        device = SimpleNamespace(
            get_numbuttons=lambda: 6,
            get_name=lambda: "Pad",
            get_instance_id=lambda: 7,
            get_button=lambda number: self.pressed and number == 4,  # the last value, also when it is gone
        )
        self.display = SimpleNamespace(init=lambda: None)
        self.joystick = SimpleNamespace(
            init=lambda: None, get_count=lambda: int(self.is_plugged), Joystick=lambda number: device
        )
        self.event = SimpleNamespace(get=self._events)

    def _events(self):
        if self.is_over:
            raise self.error("video system not initialized")
        return []


@pytest.fixture
def pygame(monkeypatch):
    fake = FakePygame()
    monkeypatch.setitem(sys.modules, "pygame", fake)
    return fake


def test_it_is_held_while_the_button_is_pressed_and_the_device_is_there(pygame):
    button = GamepadButton(0, 4)
    assert not button.is_held()
    pygame.pressed = True
    assert button.is_held()
    pygame.is_plugged = False
    assert not button.is_held()
    pygame.is_plugged = True
    assert button.is_held()
    pygame.is_over = True
    assert not button.is_held()


def test_a_device_or_a_button_that_is_not_there_is_named(pygame):
    with pytest.raises(DeviceError, match=r"robot\.dead_man_device=1 is not connected; 1 are"):
        GamepadButton(1, 4)
    with pytest.raises(DeviceError, match=r"robot\.dead_man_button=6 does not exist; Pad has the buttons 0 to 5"):
        GamepadButton(0, 6)
