"""The arm's scripted operator as a LeRobot teleoperator."""

from typing import override

import numpy as np

from lerobot_excav.envs.machines.fr5.features import ACTION_NAMES
from lerobot_excav.envs.tasks.grasp.operator import ScriptedOperator
from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.scripted_teleoperator import ScriptedTeleoperator


class FR5Operator(ScriptedTeleoperator[ScriptedOperator]):
    """Put the robot's target block into the tray, go back, and hold still."""

    config_class = FR5OperatorConfig
    name = "fr5_operator"
    robot_type = "fr5_sim"
    action_names = ACTION_NAMES

    @override
    def make_operator(self, rng: np.random.Generator) -> ScriptedOperator:
        return ScriptedOperator(rng=rng)
