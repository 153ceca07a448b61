"""What the configurations of all scripted operators share."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.setting import check_settings, setting


@dataclass(kw_only=True)
class ScriptedTeleoperatorConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a scripted operator from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    seed: int = setting(
        "Seed of how the operator varies what it does; with scene and target it fixes the demonstration, so recording "
        "an episode again gives the same one",
        default=0,
        low=0,
    )

    def __post_init__(self) -> None:
        check_settings(self, "teleop.")
