"""The simulated excavator as a LeRobot robot."""

from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.simulated_robot import SimulatedRobot


class ExcavatorSim(SimulatedRobot):
    """An excavator in front of a pile, driven by `swing.vel`, `boom.vel`, `arm.vel` and `bucket.vel` in [-1, 1]."""

    config_class = ExcavatorSimConfig
    name = "excavator_sim"
