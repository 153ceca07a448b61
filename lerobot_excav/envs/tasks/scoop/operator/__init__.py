"""The scripted operator: plans the bucket's path and drives it with joystick commands."""

from lerobot_excav.envs.tasks.scoop.operator.operator import PHASES, DigOperator

__all__ = ["PHASES", "DigOperator"]
