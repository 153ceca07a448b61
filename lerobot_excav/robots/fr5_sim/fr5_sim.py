"""The simulated FR5 arm as a LeRobot robot."""

from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.simulated_robot import SimulatedRobot


class FR5Sim(SimulatedRobot):
    """An arm over a table with four blocks, driven by joint positions [rad] and the gripper's opening [0..1].

    State and action have the same names, `j1.pos` to `j6.pos` and `gripper.pos`. So the positions by which
    `lerobot-rollout` drives a robot home are an action like any other: the arm moves home and opens its gripper as a
    real one would, and no scene is restarted. The next recorded episode starts from a fresh reset all the same.
    """

    config_class = FR5SimConfig
    name = "fr5_sim"
