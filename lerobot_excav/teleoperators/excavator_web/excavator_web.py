"""A page in a browser as a LeRobot teleoperator of the excavator."""

from lerobot_excav.teleoperators.excavator_web.config_excavator_web import ExcavatorWebConfig
from lerobot_excav.teleoperators.web_teleoperator import WebTeleoperator


class ExcavatorWeb(WebTeleoperator):
    """Drive the excavator by the sticks of a page."""

    config_class = ExcavatorWebConfig
    name = "excavator_web"
    robot_type = "excavator_sim"
