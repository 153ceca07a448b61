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


class NeverHeld:
    """Nobody lets the machine move; for who only stops it."""

    def is_held(self) -> bool:
        """Return false."""
        return False


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
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")  # no window has the focus
        import pygame

        self._pygame = pygame
        pygame.display.init()  # events need it
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
        self._button, self._instance_id = button, self._joystick.get_instance_id()

    def is_held(self) -> bool:
        """Tell whether the button is pressed now."""
        try:
            self._pygame.event.get()  # updates the device; emptied, or the queue fills up and drops news
            return self._is_attached() and bool(self._joystick.get_button(self._button))
        except self._pygame.error:  # somebody has ended SDL: as good as let go
            return False

    def _is_attached(self) -> bool:
        """Tell whether the device is there: SDL keeps answering with the last values of one that is gone."""
        joysticks = self._pygame.joystick
        present = (joysticks.Joystick(i).get_instance_id() for i in range(joysticks.get_count()))
        return self._instance_id in present
