"""Configuration of `--teleop.type=excavator_operator`."""

from dataclasses import dataclass

from lerobot.teleoperators.config import TeleoperatorConfig

from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig


@TeleoperatorConfig.register_subclass("excavator_operator")
@dataclass(kw_only=True)
class ExcavatorOperatorConfig(ScriptedTeleoperatorConfig):
    """Set up the excavator's scripted operator from LeRobot's command line."""
