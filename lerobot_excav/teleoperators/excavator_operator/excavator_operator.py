"""The scripted operator as a LeRobot teleoperator.

It looks into the simulation of the connected robot, so it works with `--robot.type=excavator_sim` only. Where
demonstrations are wanted faster than in real time, use `lerobot-excav demos`.
"""

from typing import override

import numpy as np

from lerobot_excav.envs.excavator.operator import ScriptedOperator
from lerobot_excav.envs.features import ACTION_NAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots import live
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_teleoperator import ExcavatorTeleoperator


class ExcavatorOperator(ExcavatorTeleoperator):
    """Dig where the robot's target is, load, dump, and hold still.

    Starts over by itself whenever the robot's scene has been reset.
    """

    config_class = ExcavatorOperatorConfig
    name = "excavator_operator"

    def __init__(self, config: ExcavatorOperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        self._is_connected = False
        self._operator: ScriptedOperator | None = None
        self._episode: tuple[int, int] | None = None

    @property
    def is_connected(self) -> bool:
        """Whether `connect` has been called."""
        return self._is_connected

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Get ready; the robot may connect later, as it does in `lerobot-record`."""
        self._is_connected = True

    def get_action(self) -> dict[str, float]:
        """Return the operator's next command; zero once the cycle is complete.

        Raises:
            DeviceError: The operator is not connected, or not exactly one simulated excavator is.
        """
        if not self._is_connected:
            raise DeviceError("the scripted operator is not connected; call connect() first.")
        robot = live.connected_excavator()
        episode = (id(robot), robot.episode_count)
        if self._operator is None or episode != self._episode:
            seed = (self.config.seed, robot.scene_id, robot.target_id)
            self._operator = ScriptedOperator(rng=np.random.default_rng(seed))
            self._operator.reset(robot.env)
            self._episode = episode
        command = np.zeros(len(ACTION_NAMES)) if self._operator.done else self._operator.act(robot.env)
        return dict(zip(ACTION_NAMES, np.clip(command, -1.0, 1.0).tolist(), strict=True))

    def disconnect(self) -> None:
        """Let go of the robot's simulation."""
        self._is_connected = False
        self._operator, self._episode = None, None
