"""A gamepad as a LeRobot teleoperator of the excavator."""

from collections.abc import Callable
from typing import override

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.envs.tasks.scoop.sticks import joint_commands
from lerobot_excav.envs.tasks.sticks import StickResponse
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.gamepad import Gamepad, open_gamepad
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator


class ExcavatorJoystick(SimulationTeleoperator):
    """Drive the excavator with the two sticks of a gamepad.

    Args:
        config: Device, control pattern and response.
        open_device: Opens the device that the configuration names.
    """

    config_class = ExcavatorJoystickConfig
    name = "excavator_joystick"
    action_names = ACTION_NAMES

    def __init__(
        self,
        config: ExcavatorJoystickConfig,
        *,
        open_device: Callable[[ExcavatorJoystickConfig], Gamepad] = open_gamepad,
    ) -> None:
        super().__init__(config)
        self.config = config
        self._open_device = open_device
        self._device: Gamepad | None = None
        self._was_down: dict[str, bool] = {}

    @property
    def is_connected(self) -> bool:
        """Whether a device is open."""
        return self._device is not None

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Open the device.

        Raises:
            DeviceError: The device is missing, unknown to SDL and not numbered, or open already.
        """
        if self._device is not None:
            raise DeviceError(f"the gamepad {self._device.name!r} is connected already; call disconnect() first.")
        self._device = self._open_device(self.config)
        self._was_down = {}

    def get_action(self) -> dict[str, float]:
        """Return the commands of the four joints, and a key for each button that was just pressed.

        Raises:
            DeviceError: The device is not open, or it was unplugged. The last command is never repeated.
        """
        if self._device is None:
            raise DeviceError("the gamepad is not connected; call connect() first.")
        axes, buttons = self._device.read()
        config = self.config
        response = StickResponse(
            pattern=config.pattern, dead_zone=config.dead_zone, expo=config.expo, invert=tuple(config.invert)
        )
        action = dict(zip(ACTION_NAMES, joint_commands(axes, response).values(), strict=True))
        for button, key in zip(self.config.buttons, (REINITIALISE, NEXT_SCENE), strict=True):
            # A button that is down when the device is first read is held, not pressed.
            if buttons[button] and not self._was_down.get(button, True):
                action[key] = 1.0
        self._was_down = buttons
        return action

    def disconnect(self) -> None:
        """Close the device.

        Raises:
            DeviceError: The device is not open.
        """
        if self._device is None:
            raise DeviceError("the gamepad is not connected.")
        self._device.close()
        self._device = None
