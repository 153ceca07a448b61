"""The scripted operator of the arm."""

from lerobot_excav.envs.tasks.grasp.operator.operator import GraspOperator

__all__ = ["GraspOperator"]
