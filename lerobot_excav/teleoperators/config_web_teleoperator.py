"""What the configurations of all pages that drive a robot share."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.setting import check_settings, setting


@dataclass(kw_only=True)
class WebTeleoperatorConfig(TeleoperatorConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a page in a browser from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    host: str = setting(
        "Address to listen at; another than 127.0.0.1 lets other machines in, which need the token too",
        default="127.0.0.1",
    )
    port: int = setting("Port of the page; 0 takes a free one", default=8750, low=0, high=65535)
    height: int = setting("Height of the live pictures [px]", default=480, low=96, high=1440)
    width: int = setting("Width of the live pictures [px]", default=640, low=128, high=1920)

    def __post_init__(self) -> None:
        check_settings(self, "teleop.")
