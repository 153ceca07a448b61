"""Configuration of `--teleop.type=fr5_operator`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig


@TeleoperatorConfig.register_subclass("fr5_operator")
@dataclass(kw_only=True)
class FR5OperatorConfig(ScriptedTeleoperatorConfig):
    """Set up the arm's scripted operator from LeRobot's command line."""
