"""`lerobot-record` with a gamepad that SDL itself simulates: `python -m validation.judges.pad_recorder FLAGS`.

The teleoperator opens it as any other device; only the hand that moves the sticks is missing.
"""

import ctypes
import math
import os
import sys
import threading
import time
from pathlib import Path

GAMEPAD, AXES, BUTTONS = 1, 6, 15
"""SDL's number of the type, and what such a device has."""

FULL = 32767
"""Reading of an axis at its end."""

PERIODS_S = (4.0, 5.0, 3.0, 6.0)
"""How fast each stick goes to and fro [s]."""


def main() -> None:
    """Plug the gamepad in, move its sticks for as long as the command runs, and run the command."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    import pygame

    pygame.display.init()
    pygame.joystick.init()
    (library,) = Path(pygame.__file__).parent.with_name("pygame.libs").glob("libSDL2-2*")
    sdl = ctypes.CDLL(str(library))
    number = sdl.SDL_JoystickAttachVirtual(GAMEPAD, AXES, BUTTONS, 0)
    if number < 0:
        raise RuntimeError("SDL cannot simulate a gamepad here")
    sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
    device = ctypes.c_void_p(sdl.SDL_JoystickOpen(number))
    threading.Thread(target=_move, args=(sdl, device), daemon=True).start()
    from lerobot.scripts.lerobot_record import main as record

    record()


def _move(sdl: ctypes.CDLL, device: ctypes.c_void_p) -> None:
    start_s = time.monotonic()
    while True:
        passed_s = time.monotonic() - start_s
        for axis, period_s in enumerate(PERIODS_S):
            value = round(0.8 * FULL * math.sin(2.0 * math.pi * passed_s / period_s))
            sdl.SDL_JoystickSetVirtualAxis(device, axis, ctypes.c_int16(value))
        time.sleep(0.02)


if __name__ == "__main__":
    sys.exit(main())
