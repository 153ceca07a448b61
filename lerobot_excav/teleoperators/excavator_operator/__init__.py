"""The scripted operator as a LeRobot teleoperator."""

from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig

__all__ = ["ExcavatorOperatorConfig"]
