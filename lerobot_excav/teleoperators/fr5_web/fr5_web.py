"""A page in a browser as a LeRobot teleoperator of the arm."""

from lerobot_excav.teleoperators.fr5_web.config_fr5_web import FR5WebConfig
from lerobot_excav.teleoperators.web_teleoperator import WebTeleoperator


class FR5Web(WebTeleoperator):
    """Drive the arm by the sticks of a page."""

    config_class = FR5WebConfig
    name = "fr5_web"
    robot_type = "fr5_sim"
