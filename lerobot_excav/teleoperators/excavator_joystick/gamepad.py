"""Gamepads and joysticks, read through SDL (pygame), with axes and buttons by name.

SDL's controller database knows where every axis of a known gamepad is; the numbers of a plain joystick differ
from model to model (axis 3 is the right stick's x on one pad and its y on another), so they are used only
when the configuration gives them.
"""

import os
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from lerobot_excav.envs.tasks.sticks import AXES
from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig

_FULL_DEFLECTION = 32767  # SDL reports controller axes as 16-bit integers

_SDL_AXES = {"left_x": "LEFTX", "left_y": "LEFTY", "right_x": "RIGHTX", "right_y": "RIGHTY"}


class Gamepad(Protocol):
    """What the teleoperator needs of a device."""

    name: str

    def read(self) -> tuple[dict[str, float], dict[str, bool]]:
        """Return the position of every axis in [-1, 1] and whether each button in use is down.

        Raises:
            DeviceError: The device is gone.
        """

    def close(self) -> None:
        """Close the device."""


class KnownGamepad:
    """A device that SDL knows as a gamepad.

    Args:
        pygame: The pygame module.
        controller: The device, a `pygame._sdl2.controller.Controller`.
        buttons: Names of the buttons in use.
    """

    def __init__(self, pygame: Any, controller: Any, buttons: tuple[str, ...]) -> None:
        self.name = str(controller.name)
        self._pygame, self._controller = pygame, controller
        self._axes = {axis: getattr(pygame, f"CONTROLLER_AXIS_{_SDL_AXES[axis]}") for axis in AXES}
        self._buttons = {name: getattr(pygame, f"CONTROLLER_BUTTON_{name.upper()}") for name in buttons}

    def read(self) -> tuple[dict[str, float], dict[str, bool]]:
        """Return axes and buttons; see `Gamepad.read`."""
        self._pygame.event.get()  # updates the device; emptied, or the queue fills up and drops news
        if not self._controller.attached():
            raise lost(self.name)
        axes = {axis: self._controller.get_axis(i) / _FULL_DEFLECTION for axis, i in self._axes.items()}
        return axes, {name: bool(self._controller.get_button(i)) for name, i in self._buttons.items()}

    def close(self) -> None:
        """Close the device."""
        self._controller.quit()


class PlainJoystick:
    """A device whose axes and buttons the configuration numbers.

    Args:
        pygame: The pygame module.
        joystick: The device, a `pygame.joystick.Joystick`.
        axes: Number of each axis.
        buttons: Number of each button in use.

    Raises:
        DeviceError: The device has fewer axes or buttons than the configuration numbers.
    """

    def __init__(self, pygame: Any, joystick: Any, axes: Mapping[str, int], buttons: Mapping[str, int]) -> None:
        self.name = str(joystick.get_name())
        self._pygame, self._axes, self._buttons = pygame, axes, buttons
        self._joystick: Any | None = joystick
        self._instance_id = joystick.get_instance_id()
        for field, numbers, count in (
            ("joystick_axes", axes, joystick.get_numaxes()),
            ("joystick_buttons", buttons, joystick.get_numbuttons()),
        ):
            beyond = {name: number for name, number in numbers.items() if number >= count}
            if beyond:
                raise DeviceError(f"teleop.{field}: {beyond} do not exist; {self.name!r} has {count}, from 0.")

    def read(self) -> tuple[dict[str, float], dict[str, bool]]:
        """Return axes and buttons; see `Gamepad.read`."""
        # SDL keeps answering with the last values of a joystick that is gone, and two devices share the events.
        self._pygame.event.get()  # updates the device; emptied, or the queue fills up and drops news
        if self._joystick is None or not self._is_attached():
            raise lost(self.name)
        axes = {axis: float(self._joystick.get_axis(i)) for axis, i in self._axes.items()}
        return axes, {name: bool(self._joystick.get_button(i)) for name, i in self._buttons.items()}

    def _is_attached(self) -> bool:
        joysticks = self._pygame.joystick
        present = (joysticks.Joystick(i).get_instance_id() for i in range(joysticks.get_count()))
        return self._instance_id in present

    def close(self) -> None:
        """Close the device."""
        if self._joystick is not None:
            self._joystick.quit()
            self._joystick = None


def open_gamepad(config: ExcavatorJoystickConfig) -> Gamepad:
    """Open the chosen device.

    Raises:
        DeviceError: The device is not there, or it is a joystick that SDL does not know and the configuration
            does not number.
    """
    pygame, sdl_controller = start_sdl()
    found = connected_devices()
    axes, buttons = config.joystick_axes, config.joystick_buttons
    is_numbered = axes is not None and buttons is not None
    chosen = choose_device(found, index=config.device_index, name=config.device_name, is_numbered=is_numbered)
    if axes is not None and buttons is not None:
        return PlainJoystick(pygame, pygame.joystick.Joystick(chosen), axes, buttons)
    name, is_gamepad = found[chosen]
    if is_gamepad:
        return KnownGamepad(pygame, sdl_controller.Controller(chosen), config.buttons)
    joystick = pygame.joystick.Joystick(chosen)
    raise DeviceError(
        f"SDL does not know {name!r} as a gamepad ({joystick.get_numaxes()} axes, "
        f"{joystick.get_numbuttons()} buttons), so its axes have no names. Number them, for example "
        "--teleop.joystick_axes='{left_x: 0, left_y: 1, right_x: 3, right_y: 4}' "
        f"--teleop.joystick_buttons='{{{config.buttons[0]}: 6, {config.buttons[1]}: 7}}', or give SDL a mapping in "
        "the environment variable SDL_GAMECONTROLLERCONFIG."
    )


def connected_devices() -> list[tuple[str, bool]]:
    """Return the name of each connected device, and whether SDL knows it as a gamepad."""
    pygame, sdl_controller = start_sdl()
    pygame.event.get()  # a device that was just plugged in is an event
    count = pygame.joystick.get_count()
    return [(pygame.joystick.Joystick(i).get_name(), bool(sdl_controller.is_controller(i))) for i in range(count)]


def choose_device(
    found: Sequence[tuple[str, bool]],
    *,
    index: int | None = None,
    name: str | None = None,
    is_numbered: bool = False,
    prefix: str = "device",
) -> int:
    """Return the position of the wanted device.

    SDL lists keyboards with extra keys and the motion sensors of gamepads as joysticks too. So a device that SDL knows
    as a gamepad comes first, unless the user has numbered the axes and so means another.

    Args:
        found: Name of each connected device, and whether SDL knows it as a gamepad.
        index: Position wanted.
        name: Whole name wanted or, if no device has it, a part of one; any case.
        is_numbered: Whether the user has numbered axes and buttons.
        prefix: What the settings begin with that choose it, for messages.

    Raises:
        DeviceError: No device has this position or name, or several come into question.
    """
    listed = ", ".join(
        f"{i}: {each!r}{' (gamepad)' if is_gamepad else ''}" for i, (each, is_gamepad) in enumerate(found)
    )
    if index is not None:
        candidates = [index] if index < len(found) else []
    else:
        candidates = _of_kind(found, _named(found, name), is_numbered=is_numbered)
    if len(candidates) == 1:
        return candidates[0]
    wanted = {"index": index, "name": name}
    asked = "".join(f"teleop.{prefix}_{key}={value!r}" for key, value in wanted.items() if value is not None)
    if candidates:
        raise DeviceError(
            f"{asked or 'the gamepad'} could be any of {len(candidates)} devices; connected: {listed}. Choose one with "
            f"--teleop.{prefix}_index, out of {', '.join(map(str, candidates))}."
        )
    problem = f"{asked} does not match a device" if asked else "there is no gamepad"
    raise DeviceError(
        f"{problem}; connected: {listed or 'none'}. Plug one in, check that you may read /dev/input, or use "
        "--teleop.type=excavator_operator, which needs no gamepad."
    )


def _named(found: Sequence[tuple[str, bool]], name: str | None) -> list[int]:
    """Return the devices of a name or, if there are none, those whose name holds it."""
    if name is None:
        return list(range(len(found)))
    same = [i for i, (each, _) in enumerate(found) if each.lower() == name.lower()]
    return same or [i for i, (each, _) in enumerate(found) if name.lower() in each.lower()]


def _of_kind(found: Sequence[tuple[str, bool]], among: list[int], *, is_numbered: bool) -> list[int]:
    """Return the gamepads among some devices; if there are none or the axes are numbered, all of them."""
    gamepads = [i for i in among if found[i][1]]
    return among if is_numbered or not gamepads else gamepads


def lost(name: str) -> DeviceError:
    """Return the error for a device that was unplugged or ran out of power."""
    return DeviceError(f"the gamepad {name!r} is gone; plug it in again, and let go of the sticks.")


def start_sdl() -> tuple[Any, Any]:
    """Start SDL's joystick part without a window; return pygame and its module of controllers."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")  # no window has the focus
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    import pygame
    from pygame._sdl2 import controller

    pygame.display.init()  # events need it
    pygame.joystick.init()
    controller.init()
    return pygame, controller
