"""Configuration of `--teleop.type=excavator_keyboard`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.envs.tasks.sticks import PATTERN_NAMES
from lerobot_excav.setting import check_settings, setting


@TeleoperatorConfig.register_subclass("excavator_keyboard")
@dataclass(kw_only=True)
class ExcavatorKeyboardConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up the keyboard from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    pattern: str = setting(
        "Control pattern: iso (left hand swing and arm, right hand boom and bucket) or sae (boom and arm change hands)",
        default="iso",
        choices=PATTERN_NAMES,
    )
    speed: float = setting("How far a key deflects its stick", default=1.0, above=0, high=1)

    def __post_init__(self) -> None:
        check_settings(self, "teleop.")
