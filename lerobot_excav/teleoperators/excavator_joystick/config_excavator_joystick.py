"""Configuration of `--teleop.type=excavator_joystick`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.envs.tasks.sticks import AXES, PATTERN_NAMES
from lerobot_excav.errors import require
from lerobot_excav.setting import check_settings, setting

BUTTONS = (
    *("a", "b", "x", "y", "back", "guide", "start"),
    *("leftstick", "rightstick", "leftshoulder", "rightshoulder"),
    *("dpad_up", "dpad_down", "dpad_left", "dpad_right"),
)
"""Buttons of a gamepad, by the names that SDL gives them; other names may be printed on the device."""

_LAST_NUMBER = 255  # of a device, an axis or a button


@TeleoperatorConfig.register_subclass("excavator_joystick")
@dataclass(kw_only=True)
class ExcavatorJoystickConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a gamepad from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    pattern: str = setting(
        "Control pattern: iso (left hand swing and arm, right hand boom and bucket) or sae (boom and arm change hands)",
        default="iso",
        choices=PATTERN_NAMES,
    )
    dead_zone: float = setting(
        "Deflection without effect; the rest is rescaled, so control starts without a step",
        default=0.08,
        low=0,
        high=0.99,
        hint="Usual: 0.05 to 0.1.",
    )
    expo: float = setting(
        "From 0, a straight response, to 1, the finest control near the centre", default=0.0, low=0, high=1
    )
    invert: list[str] = setting("Axes to turn around, as [left_x, right_y]", default_factory=list, choices=AXES)

    reinitialise_button: str = setting("Button that restarts the scene", default="back", choices=BUTTONS)
    next_scene_button: str = setting("Button that starts the next target or scene", default="start", choices=BUTTONS)
    device_name: str | None = setting(
        "Name of the device or a part of it, any case; left out: the only gamepad", default=None
    )
    device_index: int | None = setting(
        "Position among the connected devices, where names do not tell them apart",
        default=None,
        low=0,
        high=_LAST_NUMBER,
    )

    right_device_name: str | None = setting(
        "Two single sticks: name of the one for the right hand, or a part of it; device_name is the left one",
        default=None,
    )
    right_device_index: int | None = setting(
        "Two single sticks: position of the one for the right hand", default=None, low=0, high=_LAST_NUMBER
    )

    # Numbers differ between devices, so none is assumed.
    joystick_axes: dict[str, int] | None = setting(
        "Number of each axis, for a device that SDL does not know as a gamepad", default=None, low=0, high=_LAST_NUMBER
    )
    joystick_buttons: dict[str, int] | None = setting(
        "Number of both buttons named above, for such a device; of two single sticks for the left one, which has none "
        "unless they are numbered",
        default=None,
        low=0,
        high=_LAST_NUMBER,
    )

    def __post_init__(self) -> None:
        check_settings(self, "teleop.")
        require(
            self.reinitialise_button != self.next_scene_button,
            f"teleop.reinitialise_button and teleop.next_scene_button are both {self.next_scene_button!r}; "
            "give them two buttons.",
        )
        require(
            self.device_name is None or self.device_index is None,
            f"teleop.device_name={self.device_name!r} and teleop.device_index={self.device_index} both choose a "
            "device; give one of them.",
        )
        require(
            self.right_device_name is None or self.right_device_index is None,
            f"teleop.right_device_name={self.right_device_name!r} and teleop.right_device_index="
            f"{self.right_device_index} both choose the stick for the right hand; give one of them.",
        )
        require(
            not self.has_two_sticks or self.joystick_axes is None,
            "teleop.joystick_axes numbers the axes of one device; of two single sticks the first two axes are taken. "
            "Leave it out.",
        )
        require(
            not self.has_two_sticks or self.device_name is not None or self.device_index is not None,
            "teleop.right_device_name and teleop.right_device_index name the stick for the right hand only; name the "
            "one for the left hand by teleop.device_name or teleop.device_index, too.",
        )
        for name, names in (("joystick_axes", AXES), ("joystick_buttons", self.buttons)):
            numbers = getattr(self, name)
            require(
                numbers is None or (set(numbers) == set(names) and len(set(numbers.values())) == len(names)),
                f"teleop.{name}={numbers} is not complete; it must number {', '.join(names)}, each otherwise.",
            )
        require(
            self.has_two_sticks or (self.joystick_axes is None) == (self.joystick_buttons is None),
            "teleop.joystick_axes and teleop.joystick_buttons belong together; give both or neither.",
        )

    @property
    def has_two_sticks(self) -> bool:
        """Whether each hand has a device of its own."""
        return self.right_device_name is not None or self.right_device_index is not None

    @property
    def buttons(self) -> tuple[str, str]:
        """Names of the buttons in use: restart, next scene."""
        return self.reinitialise_button, self.next_scene_button
