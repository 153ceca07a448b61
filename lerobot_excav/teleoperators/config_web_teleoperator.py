"""What the configurations of all pages that drive a robot share."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.page.settings import PageSettings
from lerobot_excav.setting import check_settings


@dataclass(kw_only=True)
class WebTeleoperatorConfig(PageSettings, TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a page in a browser from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    def __post_init__(self) -> None:
        check_settings(self, "teleop.")
