"""The excavator's scripted operator as a LeRobot teleoperator."""

from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.scripted_teleoperator import ScriptedTeleoperator


class ExcavatorOperator(ScriptedTeleoperator):
    """Dig where the robot's target is, load, dump, and hold still."""

    config_class = ExcavatorOperatorConfig
    name = "excavator_operator"
    robot_type = "excavator_sim"
