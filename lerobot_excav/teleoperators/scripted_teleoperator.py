"""A scripted operator as a LeRobot teleoperator.

It looks into the simulation of the connected robot, so it works with one type of simulated robot only. Where
demonstrations are wanted faster than in real time, use `lerobot-excav demos`.
"""

from abc import abstractmethod
from typing import Any, ClassVar, Protocol, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.teleoperators.config_scripted_teleoperator import ScriptedTeleoperatorConfig
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator


class Script(Protocol):
    """What a teleoperator needs of the operator behind it."""

    def reset(self, env: Any) -> None:
        """Plan anew for the state of an environment."""

    def act(self, env: Any) -> NDArray[Any]:
        """Return the next action."""


class ScriptedTeleoperator[Operator: Script](SimulationTeleoperator):
    """Do the robot's task by a script, which starts over by itself whenever the robot's scene has been reset.

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

    @abstractmethod
    def make_operator(self, rng: np.random.Generator) -> Operator:
        """Make the operator of one episode."""

    def command(self, operator: Operator, env: Any) -> NDArray[Any]:
        """Return the operator's next command, (actions,)."""
        return operator.act(env)

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
            seed = (self.config.seed, robot.scene_id, robot.target_id)
            self._operator = self.make_operator(np.random.default_rng(seed))
            self._operator.reset(robot.env)
            self._episode = episode
        command = np.clip(self.command(self._operator, robot.env), robot.action_low, robot.action_high)
        return dict(zip(self.action_names, command.tolist(), strict=True))

    def disconnect(self) -> None:
        """Let go of the robot's simulation."""
        self._is_connected = False
        self._operator, self._episode = None, None
