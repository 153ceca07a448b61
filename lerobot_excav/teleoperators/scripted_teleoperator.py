"""A scripted operator as a LeRobot teleoperator.

It looks into the simulation of the connected robot, so it works with one type of simulated robot only. Where
demonstrations are wanted faster than in real time, use `lerobot-excav demos`.
"""

from typing import ClassVar, override

import numpy as np

from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.envs.tasks.task import Operator
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator


class ScriptedTeleoperator(SimulationTeleoperator):
    """Do the robot's task by its script, which starts over by itself whenever the robot's scene has been reset.

    Attributes:
        robot_type: The type of robot that it drives, as in `--robot.type`.
    """

    robot_type: ClassVar[str]

    def __init__(self, config: ScriptedTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        self._is_connected = False
        self._operator: Operator | None = None
        self._episode: tuple[int, int] | None = None

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the commands."""
        return task_of_robot(self.robot_type).action_names

    @property
    def is_connected(self) -> bool:
        """Whether `connect` has been called."""
        return self._is_connected

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Get ready; the robot may connect later, as it does in `lerobot-record`."""
        self._is_connected = True

    def get_action(self) -> dict[str, float]:
        """Return the operator's next command, within the limits of the robot.

        Raises:
            DeviceError: The operator is not connected, or not exactly one robot of its type is.
        """
        if not self._is_connected:
            raise DeviceError("the scripted operator is not connected; call connect() first.")
        robot = live.connected_robot(self.robot_type)
        episode = (id(robot), robot.episode_count)
        if self._operator is None or episode != self._episode:
            seed = (self.config.seed, robot.scene_id, robot.target_id, *filter(None, (robot.start["stage"],)))
            self._operator = robot.task_spec.make_operator(np.random.default_rng(seed))
            self._operator.reset(robot.env)
            self._episode = episode
        robot.note_operator("scripted")
        limits = robot.task_spec.action_low, robot.task_spec.action_high
        command = np.clip(self._operator.act(robot.env), *limits)
        return dict(zip(robot.task_spec.action_names, command.tolist(), strict=True))

    def disconnect(self) -> None:
        """Let go of the robot's simulation."""
        self._is_connected = False
        self._operator, self._episode = None, None
