"""A gamepad, or two single sticks, as a LeRobot teleoperator of the excavator."""

import logging
import time
from collections.abc import Callable
from typing import override

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.envs.tasks.scoop.sticks import joint_commands
from lerobot_excav.envs.tasks.sticks import AXES, StickResponse
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.gamepad import Gamepad, open_gamepad
from lerobot_excav.teleoperators.excavator_joystick.two_sticks import open_two_sticks
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator

logger = logging.getLogger(__name__)

RETRY_S = 1.0
"""How often a device that is gone is looked for [s] (kind: guess)."""

CENTRED, CENTRED_READS = 0.08, 3
"""Deflection that counts as none, and how many reads in a row have to show it when a device is back (kind: guess)."""


def open_device(config: ExcavatorJoystickConfig) -> Gamepad:
    """Open the gamepad or the two sticks that a configuration names.

    Raises:
        DeviceError: They are not there.
    """
    return open_two_sticks(config) if config.has_two_sticks else open_gamepad(config)


class ExcavatorJoystick(SimulationTeleoperator):
    """Drive the excavator with the two sticks of a gamepad, or with two single sticks.

    A device that is unplugged lets go of the machine: every command is zero until it is back, and its sticks were seen
    centred.

    Args:
        config: Device, control pattern and response.
        open_device: Opens what the configuration names.
    """

    config_class = ExcavatorJoystickConfig
    name = "excavator_joystick"
    action_names = ACTION_NAMES

    def __init__(
        self,
        config: ExcavatorJoystickConfig,
        *,
        open_device: Callable[[ExcavatorJoystickConfig], Gamepad] = open_device,
    ) -> None:
        super().__init__(config)
        self.config = config
        self._open_device = open_device
        self._is_connected = False
        self._device: Gamepad | None = None  # None while it is gone
        self._was_down: dict[str, bool] = {}
        self._looked_at_s = 0.0
        self._centred_reads_left = 0

    @property
    def is_connected(self) -> bool:
        """Whether `connect` has been called; the device may be gone."""
        return self._is_connected

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Open the device.

        Raises:
            DeviceError: The device is missing, unknown to SDL and not numbered, or open already.
        """
        if self._is_connected:
            name = "" if self._device is None else f" {self._device.name!r}"
            raise DeviceError(f"the gamepad{name} is connected already; call disconnect() first.")
        self._device = self._open_device(self.config)
        self._is_connected = True
        self._was_down, self._centred_reads_left = {}, 0

    def get_action(self) -> dict[str, float]:
        """Return the commands of the four joints, and a key for each button that was just pressed.

        Raises:
            DeviceError: The device was never opened.
        """
        if not self._is_connected:
            raise DeviceError("the gamepad is not connected; call connect() first.")
        axes, buttons = self._read()
        config = self.config
        response = StickResponse(
            pattern=config.pattern, dead_zone=config.dead_zone, expo=config.expo, invert=tuple(config.invert)
        )
        action = dict(zip(ACTION_NAMES, joint_commands(axes, response).values(), strict=True))
        for button, key in zip(config.buttons, (REINITIALISE, NEXT_SCENE), strict=True):
            # A button that is down when the device is first read is held, not pressed.
            if buttons.get(button) and not self._was_down.get(button, True):
                action[key] = 1.0
        self._was_down = buttons
        return action

    def _read(self) -> tuple[dict[str, float], dict[str, bool]]:
        """Return axes and buttons as far as they count; at rest while the device is gone or not yet centred."""
        rest: tuple[dict[str, float], dict[str, bool]] = dict.fromkeys(AXES, 0.0), {}
        if self._device is None and not self._find_again():
            return rest
        assert self._device is not None  # found
        try:
            axes, buttons = self._device.read()
        except DeviceError as error:
            logger.warning(f"{error} Until then the machine stands still.")
            self._device, self._looked_at_s = None, time.monotonic()
            return rest
        if self._centred_reads_left:
            is_centred = max(map(abs, axes.values())) <= CENTRED
            self._centred_reads_left = self._centred_reads_left - 1 if is_centred else CENTRED_READS
            return rest
        return axes, buttons

    def _find_again(self) -> bool:
        """Look for a device that is gone, now and then; tell whether it is back."""
        now_s = time.monotonic()
        if now_s - self._looked_at_s < RETRY_S:
            return False
        self._looked_at_s = now_s
        try:
            self._device = self._open_device(self.config)
        except DeviceError:
            return False
        logger.warning(f"{self._device.name!r} is back; it drives once its sticks were centred.")
        self._centred_reads_left, self._was_down = CENTRED_READS, {}
        return True

    def disconnect(self) -> None:
        """Close the device.

        Raises:
            DeviceError: The device was never opened.
        """
        if not self._is_connected:
            raise DeviceError("the gamepad is not connected.")
        if self._device is not None:
            self._device.close()
        self._device, self._is_connected = None, False
