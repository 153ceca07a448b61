"""The simulated FR5 arm as a LeRobot robot."""

from typing import Any, override

from lerobot_excav.envs.machines.fr5.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.machines.fr5.workcell import ACTION_HIGH, ACTION_LOW
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.simulation_version import SIMULATION_VERSION
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.simulated_robot import SimulatedRobot


class FR5Sim(SimulatedRobot[FR5GraspEnv]):
    """An arm over a table with four blocks, driven by joint positions [rad] and the gripper's opening [0..1].

    State and action have the same names, `j1.pos` to `j6.pos` and `gripper.pos`. So the positions by which
    `lerobot-rollout` drives a robot home are an action like any other: the arm moves home and opens its gripper as a
    real one would, and no scene is restarted. The next recorded episode starts from a fresh reset all the same.
    """

    config_class = FR5SimConfig
    name = "fr5_sim"
    state_names = STATE_NAMES
    action_names = ACTION_NAMES
    camera_names = CAMERAS
    action_low, action_high = ACTION_LOW, ACTION_HIGH
    simulation_version = SIMULATION_VERSION
    session_folder = "fr5_sessions"

    @override
    def make_env(self) -> FR5GraspEnv:
        return FR5GraspEnv(
            task=self.config.task,
            observation_height=self.config.observation_height,
            observation_width=self.config.observation_width,
            scene_set=self.config.scene_set,
            fps=self.config.fps,
            episode_length=ENDLESS_FRAMES,
        )

    @override
    def describe_simulation(self) -> dict[str, Any]:
        return {"env": "fr5_grasp"}  # a line without it is the excavator's
