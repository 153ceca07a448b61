"""The simulated robot that is connected in this process.

LeRobot gives a teleoperator no way to see the robot it drives. The scripted operator needs the worksite, so
a connected robot announces itself here.
"""

import weakref
from typing import TYPE_CHECKING

from lerobot_excav.errors import DeviceError

if TYPE_CHECKING:
    from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim

_connected: "weakref.WeakSet[ExcavatorSim]" = weakref.WeakSet()


def announce(robot: "ExcavatorSim") -> None:
    """Make a robot that has just connected known."""
    _connected.add(robot)


def retract(robot: "ExcavatorSim") -> None:
    """Forget a robot that disconnects; forgetting an unknown one changes nothing."""
    _connected.discard(robot)


def connected_excavator() -> "ExcavatorSim":
    """Return the one connected robot.

    Raises:
        DeviceError: No robot is connected, or several are.
    """
    robots = list(_connected)
    if len(robots) != 1:
        raise DeviceError(
            f"{len(robots)} simulated excavators are connected in this process; the scripted operator drives "
            "exactly one. Use it with --robot.type=excavator_sim, after the robot has connected."
        )
    return robots[0]
