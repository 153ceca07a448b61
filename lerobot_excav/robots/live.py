"""The simulated robots that are connected in this process.

LeRobot gives a teleoperator no way to see the robot it drives. A scripted operator needs its simulation, so
a connected robot announces itself here.
"""

import weakref
from typing import TYPE_CHECKING, Any

from lerobot_excav.errors import DeviceError

if TYPE_CHECKING:
    from lerobot_excav.robots.simulated_robot import SimulatedRobot

_connected: "weakref.WeakSet[SimulatedRobot[Any]]" = weakref.WeakSet()


def announce(robot: "SimulatedRobot[Any]") -> None:
    """Make a robot that has just connected known."""
    _connected.add(robot)


def retract(robot: "SimulatedRobot[Any]") -> None:
    """Forget a robot that disconnects; forgetting an unknown one changes nothing."""
    _connected.discard(robot)


def connected_robot(robot_type: str) -> "SimulatedRobot[Any]":
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
