"""Configuration of `--teleop.type=excavator_web`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.teleoperators.config_web_teleoperator import WebTeleoperatorConfig


@TeleoperatorConfig.register_subclass("excavator_web")
@dataclass(kw_only=True)
class ExcavatorWebConfig(WebTeleoperatorConfig):
    """Set up the excavator's page in a browser from LeRobot's command line."""
