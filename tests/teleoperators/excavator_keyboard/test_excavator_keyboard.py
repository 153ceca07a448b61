"""Keys drive the excavator."""

import pytest

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_keyboard import key_window
from lerobot_excav.teleoperators.excavator_keyboard.config_excavator_keyboard import ExcavatorKeyboardConfig
from lerobot_excav.teleoperators.excavator_keyboard.excavator_keyboard import ExcavatorKeyboard, written
from lerobot_excav.teleoperators.excavator_keyboard.key_window import KeyWindow, open_key_window

STILL = dict.fromkeys(ACTION_NAMES, 0.0)


@pytest.fixture
def window(monkeypatch):
    """SDL's window without a screen, and a function that presses or lets go of a key."""
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    pygame.font.init()
    opened = KeyWindow(pygame, ("a line",))

    def post(kind, key=None, **more):
        more |= {"key": pygame.key.key_code(key)} if key else {}
        pygame.event.post(pygame.event.Event(getattr(pygame, kind), **more))

    yield opened, post
    pygame.display.quit()


@pytest.fixture
def connect(window, tmp_path):
    def _connect(**settings):
        config = ExcavatorKeyboardConfig(calibration_dir=tmp_path, **settings)
        keyboard = ExcavatorKeyboard(config, open_window=lambda lines: window[0])
        keyboard.connect()
        return keyboard

    return _connect


@pytest.mark.parametrize(
    ("pattern", "key", "joint", "sign"),
    [
        ("iso", "a", "swing.vel", 1.0),
        ("iso", "w", "arm.vel", 1.0),
        ("iso", "down", "boom.vel", 1.0),
        ("iso", "left", "bucket.vel", -1.0),
        ("sae", "s", "boom.vel", 1.0),
        ("sae", "up", "arm.vel", 1.0),
    ],
)
def test_a_key_drives_its_joint_as_long_as_it_is_down(window, connect, pattern, key, joint, sign):
    keyboard, post = connect(pattern=pattern, speed=0.5), window[1]
    post("KEYDOWN", key)
    for _ in range(2):
        assert keyboard.get_action() == STILL | {joint: 0.5 * sign}
    post("KEYUP", key)
    assert keyboard.get_action() == STILL


def test_two_keys_of_an_axis_cancel_and_those_of_two_axes_add(window, connect):
    keyboard, post = connect(), window[1]
    for key in ("a", "d", "s"):
        post("KEYDOWN", key)
    assert keyboard.get_action() == STILL | {"arm.vel": -1.0}


def test_a_window_that_loses_the_focus_lets_go_and_one_that_is_closed_ends_the_command(window, connect):
    keyboard, post = connect(), window[1]
    post("KEYDOWN", "a")
    assert keyboard.get_action() != STILL
    post("WINDOWFOCUSLOST")
    assert keyboard.get_action() == STILL
    post("QUIT")
    for _ in range(2):
        with pytest.raises(DeviceError, match="was closed"):
            keyboard.get_action()


def test_the_scene_begins_again_and_the_next_one_is_shown_once_per_press(window, connect):
    keyboard, post = connect(), window[1]
    post("KEYDOWN", "b")
    assert keyboard.get_action() == STILL | {"reinitialise": 1.0}
    assert keyboard.get_action() == STILL
    post("KEYDOWN", "x")
    assert keyboard.get_action() == STILL | {"next_scene": 1.0}


def test_the_window_says_what_every_key_does():
    assert written("iso")[0] == "A  swing left      D  swing right"
    assert written("sae")[1] == "W  boom down      S  boom up"
    text = " ".join(written("iso"))
    assert all(f"{key.upper()}  " in text for key in (*key_window.STICK_KEYS, "b", "x"))


def test_without_a_display_the_page_is_named(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with pytest.raises(DeviceError, match=r"--teleop\.type=excavator_web"):
        open_key_window(("a",))


def test_misuse_says_what_to_do(connect, tmp_path):
    keyboard = ExcavatorKeyboard(ExcavatorKeyboardConfig(calibration_dir=tmp_path))
    with pytest.raises(DeviceError, match="call connect"):
        keyboard.get_action()
    with pytest.raises(DeviceError, match="not open"):
        keyboard.disconnect()
    opened = connect()
    with pytest.raises(DeviceError, match="open already"):
        opened.connect()
    opened.disconnect()
    assert not opened.is_connected
