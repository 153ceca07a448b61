"""Devices are chosen by name or position, read by name, and their loss is noticed."""

from types import SimpleNamespace
from typing import Any

import pytest

from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_joystick import gamepad
from lerobot_excav.teleoperators.excavator_joystick.gamepad import (
    KnownGamepad,
    PlainJoystick,
    choose_device,
    open_gamepad,
)

BUTTONS = ("back", "start")
AXES = {"left_x": 0, "left_y": 1, "right_x": 3, "right_y": 4}
JOYDEVICEREMOVED = 17


class StandInController:
    """SDL's view of a known gamepad: integers by axis name."""

    name = "Pad"

    def __init__(self) -> None:
        self.is_attached = True
        self.axes = {"LX": 0, "LY": 0, "RX": 0, "RY": 0}
        self.down: set[str] = set()

    def attached(self) -> bool:
        return self.is_attached

    def get_axis(self, axis: str) -> int:
        return self.axes[axis]

    def get_button(self, button: str) -> bool:
        return button in self.down

    def quit(self) -> None: ...


class StandInJoystick:
    """SDL's view of an unknown joystick: numbered axes."""

    def __init__(self) -> None:
        self.axes = [0.1, 0.2, 0.3, 0.4, 0.5]
        self.buttons = [False] * 8

    def get_name(self) -> str:
        return "Stick"

    def get_instance_id(self) -> int:
        return 42

    def get_numaxes(self) -> int:
        return len(self.axes)

    def get_numbuttons(self) -> int:
        return len(self.buttons)

    def get_axis(self, number: int) -> float:
        return self.axes[number]

    def get_button(self, number: int) -> bool:
        return self.buttons[number]

    def quit(self) -> None: ...


class StandInSdl:
    """The parts of pygame in use."""

    CONTROLLER_AXIS_LEFTX, CONTROLLER_AXIS_LEFTY = "LX", "LY"
    CONTROLLER_AXIS_RIGHTX, CONTROLLER_AXIS_RIGHTY = "RX", "RY"
    CONTROLLER_BUTTON_BACK, CONTROLLER_BUTTON_START = "B6", "B7"
    JOYDEVICEREMOVED = JOYDEVICEREMOVED

    def __init__(self, joysticks: tuple[StandInJoystick, ...] = ()) -> None:
        self.queue: list[Any] = []
        self.event = SimpleNamespace(get=self._take)
        self.joystick = SimpleNamespace(Joystick=joysticks.__getitem__, get_count=lambda: len(joysticks))

    def _take(self) -> list[Any]:
        events, self.queue = self.queue, []
        return events


def test_a_known_gamepad_is_read_by_name() -> None:
    controller = StandInController()
    pad = KnownGamepad(StandInSdl(), controller, BUTTONS)
    controller.axes |= {"LX": 32767, "RY": -16384}
    controller.down = {"B7"}
    axes, buttons = pad.read()
    assert axes == pytest.approx({"left_x": 1.0, "left_y": 0.0, "right_x": 0.0, "right_y": -0.5}, abs=1e-4)
    assert buttons == {"back": False, "start": True}


def test_an_unplugged_gamepad_is_an_error_every_time() -> None:
    controller = StandInController()
    pad = KnownGamepad(StandInSdl(), controller, BUTTONS)
    controller.axes["LX"] = 32767  # SDL would go on answering with this
    controller.is_attached = False
    for _ in range(2):
        with pytest.raises(DeviceError, match="'Pad' is gone; plug it in again"):
            pad.read()


def test_a_plain_joystick_is_read_by_the_given_numbers() -> None:
    joystick = StandInJoystick()
    joystick.buttons[6] = True
    axes, buttons = PlainJoystick(StandInSdl(), joystick, AXES, {"back": 6, "start": 7}).read()
    assert axes == {"left_x": 0.1, "left_y": 0.2, "right_x": 0.4, "right_y": 0.5}
    assert buttons == {"back": True, "start": False}


def test_an_unplugged_joystick_is_an_error_every_time() -> None:
    sdl = StandInSdl()
    stick = PlainJoystick(sdl, StandInJoystick(), AXES, {"back": 6, "start": 7})
    sdl.queue = [SimpleNamespace(type=JOYDEVICEREMOVED, instance_id=7)]  # another device
    stick.read()
    sdl.queue = [SimpleNamespace(type=JOYDEVICEREMOVED, instance_id=42)]
    for _ in range(2):
        with pytest.raises(DeviceError, match="'Stick' is gone"):
            stick.read()


def test_numbers_beyond_the_joystick_are_refused() -> None:
    with pytest.raises(DeviceError, match=r"joystick_axes: \{'right_y': 9\} do not exist; 'Stick' has 5"):
        PlainJoystick(StandInSdl(), StandInJoystick(), AXES | {"right_y": 9}, {"back": 6, "start": 7})


def test_devices_are_chosen_by_position_or_by_part_of_the_name() -> None:
    found = ["Left Stick", "Xbox Pad", "Pad 2"]
    assert choose_device(found, index=2, name=None) == 2
    assert choose_device(found, index=0, name="pad") == 1


@pytest.mark.parametrize(
    ("found", "index", "name", "message"),
    [
        ([], 0, None, "no gamepad for teleop.device_index=0; connected: none. Plug one in"),
        (["Xbox Pad"], 1, None, "no gamepad for teleop.device_index=1; connected: 0: 'Xbox Pad'"),
        (["Xbox Pad"], 0, "stick", "no gamepad for teleop.device_name='stick'; connected: 0: 'Xbox Pad'"),
    ],
)
def test_a_missing_device_is_described(found: list[str], index: int, name: str | None, message: str) -> None:
    with pytest.raises(DeviceError) as raised:
        choose_device(found, index=index, name=name)
    assert message in str(raised.value)
    assert "--teleop.type=excavator_operator" in str(raised.value)


def open_stand_in(monkeypatch: pytest.MonkeyPatch, *, is_controller: bool, **numbers: Any) -> gamepad.Gamepad:
    sdl_controller = SimpleNamespace(
        is_controller=lambda index: is_controller, Controller=lambda index: StandInController()
    )
    sdl = StandInSdl((StandInJoystick(),))
    monkeypatch.setattr(gamepad, "_start_sdl", lambda: (sdl, sdl_controller))
    settings: dict[str, Any] = {"joystick_axes": None, "joystick_buttons": None, **numbers}
    return open_gamepad(index=0, name=None, buttons=BUTTONS, **settings)


def test_a_gamepad_that_sdl_knows_needs_no_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(open_stand_in(monkeypatch, is_controller=True), KnownGamepad)


def test_an_unknown_joystick_is_never_guessed_at(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        DeviceError, match=r"does not know 'Stick' as a gamepad \(5 axes, 8 buttons\)"
    ) as raised:
        open_stand_in(monkeypatch, is_controller=False)
    assert "--teleop.joystick_axes='{left_x: 0" in str(raised.value)
    numbers = {"joystick_axes": AXES, "joystick_buttons": {"back": 6, "start": 7}}
    assert isinstance(open_stand_in(monkeypatch, is_controller=False, **numbers), PlainJoystick)


def test_sdl_itself_starts_without_a_screen() -> None:
    with pytest.raises(DeviceError, match=r"teleop\.device_name='no such pad'"):
        open_gamepad(index=0, name="no such pad", buttons=BUTTONS, joystick_axes=None, joystick_buttons=None)
