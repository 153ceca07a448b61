"""A small window that takes keys while it has the focus."""

import os
from collections.abc import Mapping
from typing import Any, Protocol

from lerobot_excav.errors import DeviceError

STICK_KEYS: Mapping[str, tuple[str, float]] = {
    "a": ("left_x", -1.0), "d": ("left_x", 1.0), "w": ("left_y", -1.0), "s": ("left_y", 1.0),
    "left": ("right_x", -1.0), "right": ("right_x", 1.0), "up": ("right_y", -1.0), "down": ("right_y", 1.0),
}  # fmt: skip
"""Which axis a key deflects, and to which side; the keys of the console's page."""

AGAIN_KEY, NEXT_KEY = "b", "x"

_SIZE_PX = (520, 150)
_PAPER_RGB, _INK_RGB = (30, 34, 39), (233, 234, 234)
_LINE_PX = 28


class Keys(Protocol):
    """What the teleoperator needs of a keyboard."""

    def read(self) -> tuple[set[str], set[str]]:
        """Return the keys that are down, and those that were pressed since the last call.

        Raises:
            DeviceError: The window was closed.
        """

    def close(self) -> None:
        """Close the window."""


class KeyWindow:
    """A window with the keys written in it. A window without the focus has no key down.

    Args:
        pygame: The pygame module, whose display is started.
        lines: What is written.
    """

    def __init__(self, pygame: Any, lines: tuple[str, ...]) -> None:
        self._pygame, self._down, self._is_closed = pygame, set[str](), False
        screen = pygame.display.set_mode(_SIZE_PX)
        pygame.display.set_caption("Excavator: keep this window in front")
        screen.fill(_PAPER_RGB)
        font = pygame.font.Font(None, _LINE_PX)
        for number, line in enumerate(lines):
            text = font.render(line, True, _INK_RGB)  # noqa: FBT003 - it takes no names
            screen.blit(text, (16, 14 + number * _LINE_PX))
        pygame.display.flip()

    def read(self) -> tuple[set[str], set[str]]:
        """Return the keys that are down, and those that were pressed; see `Keys.read`."""
        pygame, pressed = self._pygame, set[str]()
        for event in pygame.event.get():
            if event.type == pygame.KEYDOWN:
                self._down.add(pygame.key.name(event.key))
                pressed.add(pygame.key.name(event.key))
            elif event.type == pygame.KEYUP:
                self._down.discard(pygame.key.name(event.key))
            elif event.type == pygame.WINDOWFOCUSLOST:
                self._down.clear()
            elif event.type == pygame.QUIT:
                self._is_closed = True
        if self._is_closed:
            raise DeviceError("the window of the keyboard was closed; start the command again.")
        return set(self._down), pressed

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()


def open_key_window(lines: tuple[str, ...]) -> KeyWindow:
    """Open the window.

    Raises:
        DeviceError: There is no display.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    import pygame

    try:
        pygame.display.init()
    except pygame.error as error:
        raise _no_display() from error
    if pygame.display.get_driver() in ("dummy", "offscreen"):
        pygame.display.quit()
        raise _no_display()
    pygame.font.init()
    return KeyWindow(pygame, lines)


def _no_display() -> DeviceError:
    return DeviceError(
        "there is no display for the window that takes the keys; use --teleop.type=excavator_web, whose page takes the "
        "same keys in a browser."
    )
