"""The simulated robots that are connected in this process.

LeRobot gives a teleoperator no way to see the robot it drives, and a scripted operator needs its simulation.
"""

from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.simulated_robot import SimulatedRobot


def connected_robot(robot_type: str) -> SimulatedRobot:
    """Return the one connected robot of a type, named as in `--robot.type`.

    Raises:
        DeviceError: No such robot is connected, or several are.
    """
    robots = [robot for robot in SimulatedRobot.connected if robot.name == robot_type]
    if len(robots) != 1:
        raise DeviceError(
            f"{len(robots)} robots of type {robot_type} are connected in this process; the scripted operator "
            f"drives exactly one. Use it with --robot.type={robot_type}, after the robot has connected."
        )
    return robots[0]
