"""Two devices with one stick each, as a machine's cab has them."""

from lerobot_excav.errors import DeviceError
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.gamepad import (
    Gamepad,
    PlainJoystick,
    choose_device,
    connected_devices,
    start_sdl,
)

# SDL lists x and y of a stick first; twist, throttle and hat come after them.
_LEFT_AXES, _RIGHT_AXES = {"left_x": 0, "left_y": 1}, {"right_x": 0, "right_y": 1}


class TwoSticks:
    """One device for each hand; the buttons are those of the left one.

    Args:
        left: Device for the left hand.
        right: Device for the right hand.
        buttons: Names of the buttons in use; without numbers they are never down.
    """

    def __init__(self, left: Gamepad, right: Gamepad, buttons: tuple[str, ...]) -> None:
        self.name = f"{left.name} and {right.name}"
        self._left, self._right, self._buttons = left, right, buttons

    def read(self) -> tuple[dict[str, float], dict[str, bool]]:
        """Return axes and buttons; see `Gamepad.read`."""
        axes, down = self._left.read()
        right_axes, _ = self._right.read()
        return {**axes, **right_axes}, dict.fromkeys(self._buttons, False) | down

    def close(self) -> None:
        """Close both."""
        self._left.close()
        self._right.close()


def open_two_sticks(config: ExcavatorJoystickConfig) -> TwoSticks:
    """Open the two devices that a configuration names.

    Raises:
        DeviceError: One of them is not there, or both are the same.
    """
    pygame, _ = start_sdl()
    found = connected_devices()
    left = choose_device(found, index=config.device_index, name=config.device_name, is_numbered=True)
    right = choose_device(
        found, index=config.right_device_index, name=config.right_device_name, is_numbered=True, prefix="right_device"
    )
    if left == right:
        raise DeviceError(
            f"both hands would have the device {left}: {found[left][0]!r}; tell two of one name apart by "
            "--teleop.device_index and --teleop.right_device_index."
        )
    hands = [
        PlainJoystick(pygame, pygame.joystick.Joystick(number), axes, buttons)
        for number, axes, buttons in ((left, _LEFT_AXES, config.joystick_buttons or {}), (right, _RIGHT_AXES, {}))
    ]
    return TwoSticks(hands[0], hands[1], config.buttons)
