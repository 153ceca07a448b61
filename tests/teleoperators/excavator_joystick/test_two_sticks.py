"""Two single sticks, one for each hand."""

from types import SimpleNamespace

import pytest

from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.teleoperators.excavator_joystick import gamepad, two_sticks
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.two_sticks import open_two_sticks


def stick(name, instance, axes, down=()):
    return SimpleNamespace(
        get_name=lambda: name,
        get_instance_id=lambda: instance,
        get_numaxes=lambda: 4,
        get_numbuttons=lambda: 12,
        get_axis=[*axes, 0.9, 0.9].__getitem__,  # twist and throttle
        get_button=lambda number: number in down,
        quit=lambda: None,
    )


@pytest.fixture
def sdl(monkeypatch):
    """Two sticks of one model and a pad; `present` are those that are plugged in."""
    present = [
        stick("T16000M", 5, (-0.5, 0.25), down={1}),
        stick("Pad", 6, (0.0, 0.0)),
        stick("T16000M", 7, (1.0, -1.0)),
    ]
    pygame = SimpleNamespace(
        event=SimpleNamespace(get=list),
        joystick=SimpleNamespace(Joystick=lambda i: present[i], get_count=lambda: len(present)),
    )
    controllers = SimpleNamespace(is_controller=lambda i: present[i].get_name() == "Pad")
    for module in (gamepad, two_sticks):
        monkeypatch.setattr(module, "start_sdl", lambda: (pygame, controllers))
    return SimpleNamespace(present=present)


def test_each_hand_has_its_device_and_its_first_two_axes(sdl):
    config = ExcavatorJoystickConfig(device_index=0, right_device_index=2, joystick_buttons={"back": 0, "start": 1})
    sticks = open_two_sticks(config)
    axes, down = sticks.read()
    assert axes == {"left_x": -0.5, "left_y": 0.25, "right_x": 1.0, "right_y": -1.0}
    assert down == {"back": False, "start": True}
    other = open_two_sticks(ExcavatorJoystickConfig(device_index=2, right_device_index=0))
    assert other.read() == (
        {"left_x": 1.0, "left_y": -1.0, "right_x": -0.5, "right_y": 0.25},
        {"back": False, "start": False},
    )


@pytest.mark.parametrize("gone", [0, 2])
def test_if_either_is_unplugged_both_let_go(sdl, gone):
    sticks = open_two_sticks(ExcavatorJoystickConfig(device_index=0, right_device_index=2))
    sticks.read()
    del sdl.present[gone]
    with pytest.raises(DeviceError, match="'T16000M' is gone"):
        sticks.read()
    sticks.close()


def test_one_device_is_not_both_hands_and_a_name_of_two_has_to_be_told_apart(sdl):
    with pytest.raises(DeviceError, match="both hands would have the device 1"):
        open_two_sticks(ExcavatorJoystickConfig(device_name="pad", right_device_name="pad"))
    with pytest.raises(DeviceError, match=r"right_device_name='t16'.*any of 2 devices.*--teleop\.right_device_index"):
        open_two_sticks(ExcavatorJoystickConfig(device_index=1, right_device_name="t16"))
    with pytest.raises(DeviceError, match=r"right_device_index=9"):
        open_two_sticks(ExcavatorJoystickConfig(device_index=0, right_device_index=9))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"right_device_index": 1}, "name the one for the left hand"),
        ({"device_index": 0, "right_device_index": 1, "right_device_name": "x"}, "both choose"),
        (
            {"device_index": 0, "right_device_index": 1, "joystick_axes": dict.fromkeys(range(4))},
            "joystick_axes",
        ),
    ],
)
def test_settings_that_do_not_fit_are_refused(settings, words):
    with pytest.raises(ConfigurationError, match=words):
        ExcavatorJoystickConfig(**settings)
