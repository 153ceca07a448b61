"""The gamepad as LeRobot's commands see it."""

import pytest

from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_joystick import excavator_joystick as module
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.excavator_joystick import ExcavatorJoystick
from lerobot_excav.teleoperators.excavator_joystick.gamepad import lost

STILL = dict.fromkeys(("swing.vel", "boom.vel", "arm.vel", "bucket.vel"), 0.0)


class StandInPad:
    """A gamepad whose sticks and buttons the test moves."""

    name = "Pad"

    def __init__(self):
        self.axes = dict.fromkeys(("left_x", "left_y", "right_x", "right_y"), 0.0)
        self.down: set[str] = set()
        self.is_lost = self.is_closed = False

    def open(self, config):
        self.config = config
        return self

    def read(self):
        if self.is_lost:
            raise lost(self.name)
        return self.axes, {button: button in self.down for button in self.config.buttons}

    def close(self):
        self.is_closed = True


@pytest.fixture
def pad():
    return StandInPad()


@pytest.fixture
def connect(pad, tmp_path):
    """Connect a joystick with the given settings to the stand-in."""

    def _connect(**settings):
        config = ExcavatorJoystickConfig(calibration_dir=tmp_path, **settings)
        teleop = ExcavatorJoystick(config, open_device=pad.open)
        teleop.connect()
        return teleop

    return _connect


@pytest.mark.parametrize(
    ("settings", "command"),
    [
        ({}, {"swing.vel": 1.0, "arm.vel": -0.5}),
        ({"pattern": "sae"}, {"swing.vel": 1.0, "boom.vel": 0.5}),
        ({"invert": ["left_y"]}, {"swing.vel": 1.0, "arm.vel": 0.5}),
        ({"expo": 1.0}, {"swing.vel": 1.0, "arm.vel": -0.125}),
        ({"dead_zone": 0.6}, {"swing.vel": 1.0}),
    ],
)
def test_sticks_become_commands_as_the_settings_say(pad, connect, settings, command):
    pad.axes |= {"left_x": -1.0, "left_y": 0.5}
    action = connect(**{"dead_zone": 0.0, **settings}).get_action()
    assert action == pytest.approx(STILL | command)
    assert list(action) == list(STILL)


def test_a_press_is_told_once_and_a_button_held_from_the_start_is_none(pad, connect):
    teleop = connect(reinitialise_button="x", next_scene_button="y")
    told = []
    for down in ("x", "x", "", "x", "x", "y", "xy", "", "y"):
        pad.down = set(down)
        action = teleop.get_action()
        told.append([key for key in action if key not in STILL])
    restart, proceed = ["reinitialise"], ["next_scene"]
    assert told == [[], [], [], restart, [], proceed, restart, [], proceed]
    assert action == STILL | {"next_scene": 1.0}


def test_a_lost_device_lets_go_and_drives_again_once_it_is_back_and_centred(pad, connect, caplog, monkeypatch):
    monkeypatch.setattr(module, "RETRY_S", 0.0)
    pad.axes["left_x"] = 1.0
    teleop = connect()
    assert teleop.get_action()["swing.vel"] == -1.0
    pad.is_lost = True
    for _ in range(3):
        assert teleop.get_action() == STILL
    assert [record.message for record in caplog.records if "stands still" in record.message]
    pad.is_lost = False
    for _ in range(5):  # held over since before
        assert teleop.get_action() == STILL
    pad.axes["left_x"] = 0.0
    for _ in range(module.CENTRED_READS):
        assert teleop.get_action() == STILL
    pad.axes["left_x"] = 1.0
    assert teleop.get_action()["swing.vel"] == -1.0
    assert "is back" in caplog.text


def test_a_device_that_is_gone_is_looked_for_now_and_then_only(pad, connect, monkeypatch):
    teleop = connect()
    pad.is_lost = True
    tries = []
    monkeypatch.setattr(teleop, "_open_device", lambda config: tries.append(config) or pad.open(config))
    for _ in range(20):
        assert teleop.get_action() == STILL
    assert tries == []  # not before a second is over
    teleop.disconnect()
    assert not teleop.is_connected


def test_use_out_of_turn_is_refused(pad, connect):
    teleop = connect()
    with pytest.raises(DeviceError, match="connected already"):
        teleop.connect()
    teleop.disconnect()
    assert pad.is_closed
    assert not teleop.is_connected
    for use in (teleop.get_action, teleop.disconnect):
        with pytest.raises(DeviceError, match="not connected"):
            use()
