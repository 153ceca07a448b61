"""The keyboard as a LeRobot teleoperator of the excavator."""

from collections.abc import Callable
from typing import override

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.envs.tasks.scoop.sticks import DigSticks, joint_commands
from lerobot_excav.envs.tasks.sticks import AXES, StickResponse
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE
from lerobot_excav.teleoperators.excavator_keyboard.config_excavator_keyboard import ExcavatorKeyboardConfig
from lerobot_excav.teleoperators.excavator_keyboard.key_window import (
    AGAIN_KEY,
    NEXT_KEY,
    STICK_KEYS,
    Keys,
    open_key_window,
)
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator


class ExcavatorKeyboard(SimulationTeleoperator):
    """Drive the excavator with the keys of a small window; a key deflects its stick as far as `speed` says.

    Args:
        config: Control pattern and speed.
        open_window: Opens the window, with what is written in it.
    """

    config_class = ExcavatorKeyboardConfig
    name = "excavator_keyboard"
    action_names = ACTION_NAMES

    def __init__(
        self,
        config: ExcavatorKeyboardConfig,
        *,
        open_window: Callable[[tuple[str, ...]], Keys] = open_key_window,
    ) -> None:
        super().__init__(config)
        self.config = config
        self._open_window = open_window
        self._keys: Keys | None = None

    @property
    def is_connected(self) -> bool:
        """Whether the window is open."""
        return self._keys is not None

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Open the window.

        Raises:
            DeviceError: There is no display, or the window is open already.
        """
        if self._keys is not None:
            raise DeviceError("the window of the keyboard is open already; call disconnect() first.")
        self._keys = self._open_window(written(self.config.pattern))

    def get_action(self) -> dict[str, float]:
        """Return the commands of the four joints, and a key for each wish that was just pressed.

        Raises:
            DeviceError: The window is not open, or was closed.
        """
        if self._keys is None:
            raise DeviceError("the window of the keyboard is not open; call connect() first.")
        down, pressed = self._keys.read()
        axes = dict.fromkeys(AXES, 0.0)
        for key in down & STICK_KEYS.keys():
            axis, side = STICK_KEYS[key]
            axes[axis] += side * self.config.speed
        commands = joint_commands(axes, StickResponse(pattern=self.config.pattern, dead_zone=0.0))
        action = dict(zip(ACTION_NAMES, commands.values(), strict=True))
        wishes = {AGAIN_KEY: REINITIALISE, NEXT_KEY: NEXT_SCENE}
        return action | {wish: 1.0 for key, wish in wishes.items() if key in pressed}

    def disconnect(self) -> None:
        """Close the window.

        Raises:
            DeviceError: It is not open.
        """
        if self._keys is None:
            raise DeviceError("the window of the keyboard is not open.")
        self._keys.close()
        self._keys = None


def written(pattern: str) -> tuple[str, ...]:
    """Return what the window says: a line per axis, then the other keys."""
    legend = DigSticks.legend[pattern]
    keys = {axis: {side: key.upper() for key, (of, side) in STICK_KEYS.items() if of == axis} for axis in AXES}
    lines = (f"{keys[axis][-1.0]}  {legend[axis][0]}      {keys[axis][1.0]}  {legend[axis][1]}" for axis in AXES)
    return (*lines, f"{AGAIN_KEY.upper()}  begin again      {NEXT_KEY.upper()}  next target")
