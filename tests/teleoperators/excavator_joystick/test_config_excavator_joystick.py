"""What `--teleop.type=excavator_joystick` accepts."""

from dataclasses import dataclass

import draccus
import pytest
from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig

AXES = {"left_x": 0, "left_y": 1, "right_x": 3, "right_y": 4}


@dataclass
class Command:
    teleop: TeleoperatorConfig


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("pattern", "crane", "teleop.pattern='crane' is not possible; give one of iso, sae"),
        ("dead_zone", 1.0, "teleop.dead_zone=1.0 is not possible; give a number from 0 to 0.99"),
        ("dead_zone", -0.1, "teleop.dead_zone=-0.1"),
        ("expo", 2.0, "teleop.expo=2.0"),
        ("expo", float("nan"), "teleop.expo=nan"),
        ("invert", ["left"], "teleop.invert=['left'] is not possible; give a list, each one of left_x, left_y"),
        ("invert", "left_x", "teleop.invert='left_x' is not possible; give a list"),
        ("device_index", -1, "teleop.device_index=-1"),
        ("reinitialise_button", "select", "teleop.reinitialise_button='select' is not possible; give one of a,"),
        ("next_scene_button", "back", "both 'back'; give them two buttons"),
        ("joystick_axes", AXES, "joystick_buttons belong together; give both or neither"),
        ("joystick_axes", {"left_x": 0}, "it must number left_x, left_y, right_x, right_y"),
        ("joystick_axes", AXES | {"left_x": -1}, "give names, each with a whole number from 0 to 255"),
        ("joystick_axes", AXES | {"left_x": 1}, "each otherwise"),
        ("joystick_axes", AXES | {"left_x": "1"}, "joystick_axes={'left_x': '1'"),
        ("device_name", "", "teleop.device_name='' is not possible; give a text"),
        ("joystick_buttons", {"a": 0, "b": 1}, "it must number back, start"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(name, value, message):
    with pytest.raises(ConfigurationError) as raised:
        ExcavatorJoystickConfig(**{name: value})
    assert message in str(raised.value)


def test_a_device_is_chosen_in_one_way():
    with pytest.raises(ConfigurationError, match=r"device_name='pad' and teleop\.device_index=1 both choose"):
        ExcavatorJoystickConfig(device_name="pad", device_index=1)


def test_a_joystick_can_be_numbered_on_the_command_line():
    flags = ["--teleop.type=excavator_joystick", "--teleop.invert=[left_y]"]
    flags += ["--teleop.joystick_axes={left_x: 0, left_y: 1, right_x: 3, right_y: 4}"]
    config = draccus.parse(Command, args=[*flags, "--teleop.joystick_buttons={back: 6, start: 7}"]).teleop
    assert config.joystick_axes == AXES
    assert config.joystick_buttons == {"back": 6, "start": 7}
    assert config.invert == ["left_y"]
