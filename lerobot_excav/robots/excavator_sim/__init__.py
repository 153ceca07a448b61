"""The simulated excavator as a LeRobot robot."""

from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig

__all__ = ["ExcavatorSimConfig"]
