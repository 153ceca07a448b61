"""The arm's scripted operator as a LeRobot teleoperator."""

from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig

__all__ = ["FR5OperatorConfig"]
