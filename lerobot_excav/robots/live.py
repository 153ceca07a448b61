"""The simulated robots that are connected in this process.

LeRobot gives a teleoperator no way to see the robot it drives. A scripted operator needs its simulation, so
a connected robot announces itself here.
"""

import weakref
from typing import Any, Protocol

from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DeviceError


class LiveRobot(Protocol):
    """What a teleoperator needs of the robot it drives.

    Attributes:
        name: As in `--robot.type`.
        task_spec: The task.
        episode_count: Number of resets so far; changes exactly when an episode starts.
    """

    name: str
    task_spec: TaskSpec
    episode_count: int

    @property
    def env(self) -> Any:
        """The environment behind the robot."""

    @property
    def scene_id(self) -> int:
        """Current scene."""

    @property
    def target_id(self) -> int:
        """Target that is commanded first."""


_connected: "weakref.WeakSet[LiveRobot]" = weakref.WeakSet()


def announce(robot: LiveRobot) -> None:
    """Make a robot that has just connected known."""
    _connected.add(robot)


def retract(robot: LiveRobot) -> None:
    """Forget a robot that disconnects; forgetting an unknown one changes nothing."""
    _connected.discard(robot)


def connected_robot(robot_type: str) -> LiveRobot:
    """Return the one connected robot of a type.

    Args:
        robot_type: As in `--robot.type`.

    Raises:
        DeviceError: No such robot is connected, or several are.
    """
    robots = [robot for robot in _connected if robot.name == robot_type]
    if len(robots) != 1:
        raise DeviceError(
            f"{len(robots)} robots of type {robot_type} are connected in this process; the scripted operator "
            f"drives exactly one. Use it with --robot.type={robot_type}, after the robot has connected."
        )
    return robots[0]
