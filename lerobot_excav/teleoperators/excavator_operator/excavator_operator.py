"""The excavator's scripted operator as a LeRobot teleoperator."""

from typing import override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.scripted_teleoperator import ScriptedTeleoperator


class ExcavatorOperator(ScriptedTeleoperator[ScriptedOperator]):
    """Dig where the robot's target is, load, dump, and hold still."""

    config_class = ExcavatorOperatorConfig
    name = "excavator_operator"
    robot_type = "excavator_sim"
    action_names = ACTION_NAMES

    @override
    def make_operator(self, rng: np.random.Generator) -> ScriptedOperator:
        return ScriptedOperator(rng=rng)

    @override
    def command(self, operator: ScriptedOperator, env: ExcavatorEnv) -> NDArray[np.float32]:
        if operator.done:
            return np.zeros(len(ACTION_NAMES), np.float32)
        return operator.act(env)
