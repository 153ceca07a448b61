"""The page in a browser as a LeRobot teleoperator.

It shows the simulation of the connected robot, in the same process, so it works with one type of simulated robot only.
LeRobot's command sets the pace and records; the page drives, restarts the scene and goes on to the next target.
"""

import logging
from contextlib import ExitStack
from typing import Any, ClassVar, override

from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.errors import DeviceError
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.live_views import LiveViews
from lerobot_excav.page.scene_state import scene_state
from lerobot_excav.page.server import PageServer
from lerobot_excav.page.target_marks import Mark, target_marks
from lerobot_excav.robots import live
from lerobot_excav.robots.side_channel import NEXT_SCENE, REINITIALISE
from lerobot_excav.robots.simulated_robot import SimulatedRobot
from lerobot_excav.teleoperators.config_web_teleoperator import WebTeleoperatorConfig
from lerobot_excav.teleoperators.simulation_teleoperator import SimulationTeleoperator

logger = logging.getLogger(__name__)

SHOWN_FPS = 10
"""Pictures a second at most; they are drawn between two frames of the robot (kind: measured, 35 ms each)."""

_KEYS = {"again": REINITIALISE, "next": NEXT_SCENE}
OFFERS = (*_KEYS, "stop")
"""What the page may wish for."""


class WebTeleoperator(SimulationTeleoperator):
    """Drive the robot by the sticks of a page.

    Attributes:
        robot_type: The type of robot that it drives, as in `--robot.type`.
        address: Address of the page, with its token; None while nothing is served.
    """

    robot_type: ClassVar[str]

    def __init__(self, config: WebTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        self.address: str | None = None
        self._served = ExitStack()
        self._seat, self._feed = DriversSeat(), Feed()
        self._sticks = task_of_robot(self.robot_type).make_sticks()
        self._shown: tuple[SimulatedRobot, LiveViews] | None = None
        self._episode, self._marks = -1, list[Mark]()
        self._command: Command | None = None
        self._frames, self._sticks_number = 0, -1  # the robot acts after the picture, so it is the message before

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the commands."""
        return task_of_robot(self.robot_type).action_names

    @property
    def is_connected(self) -> bool:
        """Whether the page is served."""
        return self.address is not None

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Serve the page, and say where; the robot may connect later, as it does in `lerobot-record`.

        Raises:
            DeviceError: It is served already, or the address is taken.
        """
        if self.is_connected:
            raise DeviceError(f"the page is served already, at {self.address}")
        access = self.config.access()
        self._served.enter_context(PageServer(access, self._feed, self._seat).running())
        self.address = access.address
        logger.warning(f"Open {self.address} in a browser to drive the robot.")

    def get_action(self) -> dict[str, float]:
        """Return what the sticks ask for, and show the robot on the page.

        Raises:
            DeviceError: The page is not served, or not exactly one robot of its type is connected.
        """
        if not self.is_connected:
            raise DeviceError("the page is not served; call connect() first.")
        robot = live.connected_robot(self.robot_type)
        if robot.episode_count != self._episode:
            self._episode, self._command = robot.episode_count, None
            self._sticks.reset(robot.env)
        if robot.env.command is not self._command:
            self._command = robot.env.command
            self._marks = target_marks(robot.env)
        robot.note_operator("person")
        wishes = {wish.kind for wish in self._seat.wishes()}
        if "stop" in wishes:
            self._seat.let_go()
        axes, number = self._seat.axes()
        command = self._sticks.action(axes, self._seat.response)
        self._show(robot, command)
        self._sticks_number = number
        action = dict(zip(robot.task_spec.action_names, command.tolist(), strict=True))
        return action | {key: 1.0 for wish, key in _KEYS.items() if wish in wishes}

    def _show(self, robot: SimulatedRobot, command: Any) -> None:
        self._frames += 1
        if self._frames % max(1, round(robot.env.fps / SHOWN_FPS)):
            return
        if self._shown is None or self._shown[0] is not robot:
            self._close_views()
            self._shown = robot, LiveViews(robot.env, height=self.config.height, width=self.config.width)
        scene = scene_state(
            robot.env,
            self._seat,
            legend=self._sticks.legend,
            marks=self._marks,
            sticks_number=self._sticks_number,
            acted=command,
        )
        told = {"policy": None, "taken_over": False, "recording": None, "words": "", "fault": False, "speed": 1.0}
        pictures = self._shown[1].pictures(robot.env.observe())
        own = {"mode": "drive", "offers": list(OFFERS), "views": list(pictures)}
        self._feed.publish(scene | told | own, pictures)

    def _close_views(self) -> None:
        if self._shown is not None:
            self._shown[1].close()
            self._shown = None

    def disconnect(self) -> None:
        """Stop serving.

        Raises:
            DeviceError: Nothing is served.
        """
        if not self.is_connected:
            raise DeviceError("the page is not served.")
        self._close_views()
        self._served.close()
        self.address = None
