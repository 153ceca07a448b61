"""Configuration of `--teleop.type=fr5_web`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.teleoperators.config_web_teleoperator import WebTeleoperatorConfig


@TeleoperatorConfig.register_subclass("fr5_web")
@dataclass(kw_only=True)
class FR5WebConfig(WebTeleoperatorConfig):
    """Set up the arm's page in a browser from LeRobot's command line."""
