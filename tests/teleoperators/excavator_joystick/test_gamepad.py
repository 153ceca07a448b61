"""Devices are chosen by name or position, read by name, and their loss is noticed."""

from types import SimpleNamespace
from typing import Any

import pytest

from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_joystick import gamepad
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.gamepad import (
    KnownGamepad,
    PlainJoystick,
    choose_device,
    open_gamepad,
)

BUTTONS = ("back", "start")
AXES = {"left_x": 0, "left_y": 1, "right_x": 3, "right_y": 4}
NUMBERS = {"joystick_axes": AXES, "joystick_buttons": {"back": 6, "start": 7}}


@pytest.fixture
def controller():
    """SDL's view of a known gamepad: integers by axis name."""
    axes, down = {"LX": 32767, "LY": 0, "RX": 0, "RY": -16384}, {"B7"}
    return SimpleNamespace(name="Pad", attached=lambda: True, get_axis=axes.__getitem__, get_button=down.__contains__)


@pytest.fixture
def joystick():
    """SDL's view of an unknown joystick: numbered axes."""
    return SimpleNamespace(
        get_name=lambda: "Stick",
        get_instance_id=lambda: 42,
        get_numaxes=lambda: 5,
        get_numbuttons=lambda: 8,
        get_axis=[0.1, 0.2, 0.3, 0.4, 0.5].__getitem__,
        get_button=[False, False, False, False, False, False, True, False].__getitem__,
    )


@pytest.fixture
def sdl(joystick):
    """The parts of pygame in use; `queue` holds the events to come."""
    queue: list[Any] = []
    names = {f"CONTROLLER_AXIS_{side}{axis}": side[0] + axis for side in ("LEFT", "RIGHT") for axis in "XY"}
    names |= {"CONTROLLER_BUTTON_BACK": "B6", "CONTROLLER_BUTTON_START": "B7"}
    return SimpleNamespace(
        **names,
        queue=queue,
        event=SimpleNamespace(get=lambda: [queue.pop() for _ in list(queue)]),
        joystick=SimpleNamespace(Joystick=[joystick].__getitem__, get_count=lambda: 1),
    )


def test_a_known_gamepad_is_read_by_name_until_it_is_unplugged(sdl, controller):
    pad = KnownGamepad(sdl, controller, BUTTONS)
    axes, buttons = pad.read()
    assert axes == pytest.approx({"left_x": 1.0, "left_y": 0.0, "right_x": 0.0, "right_y": -0.5}, abs=1e-4)
    assert buttons == {"back": False, "start": True}
    controller.attached = lambda: False  # SDL would repeat the last values
    for _ in range(2):
        with pytest.raises(DeviceError, match="'Pad' is gone; plug it in again"):
            pad.read()


def test_a_plain_joystick_is_read_by_the_given_numbers_until_it_is_unplugged(sdl, joystick):
    stick = PlainJoystick(sdl, joystick, *NUMBERS.values())
    sdl.queue.append("news")  # has to be fetched, or the queue overflows
    axes, buttons = stick.read()
    assert sdl.queue == []
    assert axes == {"left_x": 0.1, "left_y": 0.2, "right_x": 0.4, "right_y": 0.5}
    assert buttons == {"back": True, "start": False}
    sdl.joystick.get_count = lambda: 0
    for _ in range(2):
        with pytest.raises(DeviceError, match="'Stick' is gone"):
            stick.read()


def test_numbers_beyond_the_joystick_are_refused(sdl, joystick):
    with pytest.raises(DeviceError, match=r"joystick_axes: \{'right_y': 9\} do not exist; 'Stick' has 5"):
        PlainJoystick(sdl, joystick, AXES | {"right_y": 9}, {"back": 6, "start": 7})


KEYBOARD, MOTION, PAD = ("Keychron K2", False), ("Sony Wireless Controller Motion Sensors", False), ("Xbox Pad", True)
SONY, STICK = ("Sony Wireless Controller", True), ("Left Stick", False)


@pytest.mark.parametrize(
    ("found", "wanted", "chosen"),
    [
        ([PAD], {}, 0),
        ([KEYBOARD, PAD], {}, 1),  # a keyboard with extra keys may come first
        ([MOTION, SONY], {}, 1),
        ([MOTION, SONY, PAD], {"name": "wireless controller"}, 1),
        ([PAD, SONY], {"name": "pad"}, 0),
        ([KEYBOARD, PAD, SONY], {"index": 2}, 2),
        ([KEYBOARD, PAD], {"index": 0}, 0),  # whoever numbers a device gets it
        ([STICK], {}, 0),
        ([STICK, PAD], {"name": "stick", "is_numbered": True}, 0),
        ([MOTION, ("Wireless Controller", False)], {"name": "Wireless controller", "is_numbered": True}, 1),
    ],
)
def test_a_gamepad_comes_before_other_devices_and_a_whole_name_before_a_part(found, wanted, chosen):
    assert choose_device(found, **wanted) == chosen


@pytest.mark.parametrize(
    ("found", "wanted", "message"),
    [
        ([], {}, "there is no gamepad; connected: none. Plug one in"),
        ([PAD], {"index": 1}, "teleop.device_index=1 does not match a device; connected: 0: 'Xbox Pad' (gamepad)"),
        ([PAD], {"name": "stick"}, "teleop.device_name='stick' does not match a device; connected: 0: 'Xbox"),
    ],
)
def test_a_missing_device_is_described(found, wanted, message):
    with pytest.raises(DeviceError) as raised:
        choose_device(found, **wanted)
    assert message in str(raised.value)
    assert "--teleop.type=excavator_operator" in str(raised.value)


@pytest.mark.parametrize(
    ("found", "wanted", "message"),
    [
        ([PAD, KEYBOARD, SONY], {}, "the gamepad could be any of 2 devices; .*1: 'Keychron K2', 2: 'Sony.*out of 0, 2"),
        ([PAD, PAD], {"name": "xbox"}, "teleop.device_name='xbox' could be any of 2 devices.*out of 0, 1"),
        ([KEYBOARD, STICK], {"is_numbered": True}, "any of 2 devices"),
        ([PAD, STICK], {"is_numbered": True}, "any of 2 devices"),  # numbers may be meant for either
    ],
)
def test_where_several_devices_could_be_meant_they_are_listed(found, wanted, message):
    with pytest.raises(DeviceError, match=message):
        choose_device(found, **wanted)


def test_a_gamepad_that_sdl_knows_needs_no_numbers_and_another_joystick_does(monkeypatch, sdl, controller):
    def opened(*, known, **numbers):
        sdl_controller = SimpleNamespace(is_controller=lambda _: known, Controller=lambda _: controller)
        monkeypatch.setattr(gamepad, "start_sdl", lambda: (sdl, sdl_controller))
        return open_gamepad(ExcavatorJoystickConfig(**numbers))

    assert isinstance(opened(known=True), KnownGamepad)
    assert isinstance(opened(known=False, **NUMBERS), PlainJoystick)
    unknown = r"does not know 'Stick' as a gamepad \(5 axes, 8 buttons\).*joystick_axes='\{left_x: 0"
    with pytest.raises(DeviceError, match=unknown):
        opened(known=False)
    assert isinstance(opened(known=True, **NUMBERS), PlainJoystick)  # given numbers are used
    with pytest.raises(DeviceError, match=r"teleop\.device_index=1"):
        opened(known=True, device_index=1)


def test_sdl_itself_starts_without_a_screen():
    with pytest.raises(DeviceError, match=r"teleop\.device_name='no such pad'"):
        open_gamepad(ExcavatorJoystickConfig(device_name="no such pad"))
