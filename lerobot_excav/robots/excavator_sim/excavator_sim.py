"""The simulated excavator as a LeRobot robot."""

from collections.abc import Mapping
from typing import Any, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, CAMERAS, STATE_NAMES
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.simulation_version import SIMULATION_VERSION
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.simulated_robot import SimulatedRobot


class ExcavatorSim(SimulatedRobot[ExcavatorEnv]):
    """An excavator in front of a pile, driven by `swing.vel`, `boom.vel`, `arm.vel` and `bucket.vel` in [-1, 1].

    An action with positions only, such as `lerobot-rollout` sends between episodes to drive a robot home,
    restarts the scene once: the machine takes no positions.
    """

    config_class = ExcavatorSimConfig
    name = "excavator_sim"
    state_names = STATE_NAMES
    action_names = ACTION_NAMES
    camera_names = CAMERAS
    action_low, action_high = -1.0, 1.0
    simulation_version = SIMULATION_VERSION
    session_folder = "excavator_sessions"
    config: ExcavatorSimConfig

    def __init__(self, config: ExcavatorSimConfig) -> None:
        super().__init__(config)
        self._is_homing = False

    @override
    def make_env(self) -> ExcavatorEnv:
        return ExcavatorEnv(
            task=self.config.task,
            observation_height=self.config.observation_height,
            observation_width=self.config.observation_width,
            scene_set=self.config.scene_set,
            fps=self.config.fps,
            episode_length=ENDLESS_FRAMES,
            soil=self.config.soil,
            fidelity=self.config.fidelity,
        )

    @override
    def describe_simulation(self) -> dict[str, Any]:
        return {"soil": self.config.soil, "fidelity": self.config.fidelity}

    def depth_m(self) -> NDArray[np.float32]:
        """Return the depth image registered with the main camera.

        Returns:
            Distance along the optical axis [m], shape (H, W), float32.

        Raises:
            DeviceError: The robot is not connected, or was set up without depth.
        """
        if not self.config.depth:
            raise DeviceError("this robot offers no depth image; set --robot.depth=true.")
        return self.env.depth_m()

    @override
    def send_action(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Advance the simulation by one frame, or restart it; see both classes."""
        if not action or not all(name.endswith(".pos") for name in action):
            sent = super().send_action(action)
            self._is_homing = False
            return sent
        if not self._is_homing:
            self.restart_scene()
        self._is_homing = True
        return dict(action)

    @override
    def start_scene(self) -> None:
        super().start_scene()
        self._is_homing = False
