"""The scripted operator of the arm."""

from lerobot_excav.envs.fr5.operator.operator import ScriptedOperator

__all__ = ["ScriptedOperator"]
