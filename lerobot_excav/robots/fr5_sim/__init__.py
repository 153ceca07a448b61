"""The simulated FR5 arm as a LeRobot robot."""

from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig

__all__ = ["FR5SimConfig"]
