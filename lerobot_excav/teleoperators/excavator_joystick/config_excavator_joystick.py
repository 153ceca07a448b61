"""Configuration of `--teleop.type=excavator_joystick`."""

from dataclasses import dataclass, field

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.errors import require, require_choice
from lerobot_excav.teleoperators.excavator_joystick.mapping import AXES, PATTERNS

BUTTONS = (
    *("a", "b", "x", "y", "back", "guide", "start"),
    *("leftstick", "rightstick", "leftshoulder", "rightshoulder"),
    *("dpad_up", "dpad_down", "dpad_left", "dpad_right"),
)
"""Buttons of a gamepad, by the names that SDL gives them; other names may be printed on the device."""


@TeleoperatorConfig.register_subclass("excavator_joystick")
@dataclass(kw_only=True)
class ExcavatorJoystickConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a gamepad from LeRobot's command line.

    Attributes:
        pattern: `iso` (left hand swing and arm, right hand boom and bucket) or `sae` (boom and arm change
            hands).
        dead_zone: Deflection without effect, in [0, 1); the rest is rescaled, so control starts without a
            step.
        expo: From 0, a straight response, to 1, the finest control near the centre.
        invert: Axes to turn around, out of `left_x`, `left_y`, `right_x`, `right_y`.
        reinitialise_button: Button that restarts the scene.
        next_scene_button: Button that starts the next target or scene.
        device_name: Part of the device's name, any case; None takes `device_index`.
        device_index: Position among the connected devices.
        joystick_axes: Number of each axis, for a device that SDL does not know as a gamepad. Numbers differ
            between devices, so none is assumed.
        joystick_buttons: Number of both buttons named above, for such a device.
    """

    pattern: str = "iso"
    dead_zone: float = 0.08
    expo: float = 0.0
    invert: list[str] = field(default_factory=list)
    reinitialise_button: str = "back"
    next_scene_button: str = "start"
    device_name: str | None = None
    device_index: int = 0
    joystick_axes: dict[str, int] | None = None
    joystick_buttons: dict[str, int] | None = None

    def __post_init__(self) -> None:
        """Validate the fields.

        Raises:
            ConfigurationError: A field has a value that cannot be used.
        """
        require_choice("teleop.pattern", self.pattern, tuple(PATTERNS))
        require(
            0.0 <= self.dead_zone < 1.0,
            f"teleop.dead_zone={self.dead_zone} is not possible; allowed: from 0 to below 1, usually 0.05 to 0.1.",
        )
        require(0.0 <= self.expo <= 1.0, f"teleop.expo={self.expo} is not possible; allowed: from 0 to 1.")
        for axis in self.invert:
            require_choice("teleop.invert", axis, AXES)
        require(
            self.device_index >= 0,
            f"teleop.device_index={self.device_index} is not possible; devices are numbered from 0.",
        )
        self._validate_buttons()
        self._validate_joystick()

    @property
    def buttons(self) -> tuple[str, str]:
        """Names of the buttons in use: restart, next scene."""
        return self.reinitialise_button, self.next_scene_button

    def _validate_buttons(self) -> None:
        require_choice("teleop.reinitialise_button", self.reinitialise_button, BUTTONS)
        require_choice("teleop.next_scene_button", self.next_scene_button, BUTTONS)
        require(
            self.reinitialise_button != self.next_scene_button,
            f"teleop.reinitialise_button and teleop.next_scene_button are both {self.next_scene_button!r}; "
            "give them two buttons.",
        )

    def _validate_joystick(self) -> None:
        maps = (("joystick_axes", self.joystick_axes, AXES), ("joystick_buttons", self.joystick_buttons, self.buttons))
        for name, numbers, names in maps:
            if numbers is None:
                continue
            require(
                set(numbers) == set(names) and all(number >= 0 for number in numbers.values()),
                f"teleop.{name}={numbers} is not complete; it must number {', '.join(names)} from 0 on.",
            )
