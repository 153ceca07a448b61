"""The arm's scripted operator as a LeRobot teleoperator."""

from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.scripted_teleoperator import ScriptedTeleoperator


class FR5Operator(ScriptedTeleoperator):
    """Put the robot's target block into the tray, go back, and hold still."""

    config_class = FR5OperatorConfig
    name = "fr5_operator"
    robot_type = "fr5_sim"
