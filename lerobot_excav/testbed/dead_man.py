"""The dead-man: who lets go stops the machine."""

import os
from typing import Protocol

from lerobot_excav.errors import DeviceError


class DeadMan(Protocol):
    """A switch that a person holds while the machine may move."""

    def is_held(self) -> bool:
        """Tell whether it is held now; a device that is gone is not."""


class AlwaysHeld:
    """Nobody has to hold anything; for an emulator only."""

    def is_held(self) -> bool:
        """Return true."""
        return True


class GamepadButton:
    """A button of a gamepad or joystick.

    Args:
        device: Position among the connected devices.
        button: Number of the button.

    Raises:
        DeviceError: There is no such device or button.
    """

    def __init__(self, device: int, button: int) -> None:
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # no window is needed
        import pygame

        self._pygame = pygame
        pygame.init()
        pygame.joystick.init()
        count = pygame.joystick.get_count()
        if device >= count:
            raise DeviceError(
                f"robot.dead_man_device={device} is not connected; {count} are. Plug the dead-man in, or number it."
            )
        self._joystick = pygame.joystick.Joystick(device)
        if button >= self._joystick.get_numbuttons():
            raise DeviceError(
                f"robot.dead_man_button={button} does not exist; {self._joystick.get_name()} has the buttons 0 to "
                f"{self._joystick.get_numbuttons() - 1}"
            )
        self._button = button

    def is_held(self) -> bool:
        """Tell whether the button is pressed now."""
        self._pygame.event.pump()
        return bool(self._joystick.get_init() and self._joystick.get_button(self._button))
