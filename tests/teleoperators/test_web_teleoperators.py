"""A page in a browser drives the connected robot, whichever machine it is."""

import itertools
import json
import logging
import time

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import make_teleoperator_from_config
from lerobot.teleoperators.config import TeleoperatorConfig
from websockets.sync.client import connect

import lerobot_excav.plugin  # noqa: F401 - registers every --teleop.type
from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.errors import DeviceError
from lerobot_excav.page.sticks import CENTRED_MESSAGES

CENTRE = [0.0] * 4


class Page:
    """A page without a browser."""

    def __init__(self, teleoperator):
        token = teleoperator.address.partition("token=")[2]
        port = teleoperator.address.split(":")[2].partition("/")[0]
        self._socket = connect(f"ws://127.0.0.1:{port}/live?token={token}", origin=f"http://127.0.0.1:{port}")
        self._seat, self._numbers = teleoperator._seat, itertools.count()
        self.say(kind="take")
        self.say(kind="response", pattern="iso", dead_zone=0.0, expo=0.0, invert=[])
        for _ in range(CENTRED_MESSAGES):
            self.hold(CENTRE)

    def say(self, **message):
        self._socket.send(json.dumps(message))

    def hold(self, axes):
        """Say where the sticks are, and wait until the teleoperator has heard it."""
        number = next(self._numbers)
        self.say(kind="sticks", axes=axes, number=number)
        deadline = time.monotonic() + 10.0
        while self._seat.sticks.number != number:
            assert time.monotonic() < deadline
            time.sleep(0.001)

    def moment(self):
        message = self._socket.recv(timeout=10.0)
        header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
        self.say(kind="seen", number=header["number"])
        return header

    def close(self):
        self._socket.close()


@pytest.fixture(params=["excavator", "fr5"])
def pair(request, tmp_path):
    """A connected robot and the connected page that drives it."""
    size = {"observation_height": 32, "observation_width": 48}
    robot_config = RobotConfig.get_choice_class(f"{request.param}_sim")
    robot = make_robot_from_config(
        robot_config(calibration_dir=tmp_path, session_log=tmp_path / "session.jsonl", fps=10, **size)
    )
    config = TeleoperatorConfig.get_choice_class(f"{request.param}_web")
    teleoperator = make_teleoperator_from_config(config(calibration_dir=tmp_path, port=0, height=96, width=128))
    teleoperator.connect()
    robot.connect()
    page = Page(teleoperator)
    yield robot, teleoperator, page
    page.close()
    teleoperator.disconnect()
    robot.disconnect()


def test_the_sticks_of_the_page_drive_and_sticks_at_rest_hold_the_machine_still(pair):
    robot, teleoperator, page = pair
    for _ in range(2):
        robot.send_action(teleoperator.get_action())
    before = np.array([robot.get_observation()[name] for name in robot.task_spec.state_names])
    for _ in range(CENTRED_MESSAGES):  # the first picture took long, so they are centred again
        page.hold(CENTRE)
        robot.send_action(teleoperator.get_action())
    still = np.array([robot.get_observation()[name] for name in robot.task_spec.state_names])
    np.testing.assert_allclose(still, before, atol=5e-3)
    for _ in range(8):
        page.hold([-1.0, 0.0, 0.0, 0.0])
        robot.send_action(teleoperator.get_action())
    moved = np.array([robot.get_observation()[name] for name in robot.task_spec.state_names])
    assert np.abs(moved - still).max() > 0.05


def test_the_page_shows_the_robots_scene_and_what_it_may_ask_for(pair):
    robot, teleoperator, page = pair
    teleoperator.get_action()
    header = page.moment()
    assert header["task"] == robot.env.task
    assert header["offers"] == ["again", "next", "stop"]
    assert [name for name, size in header["pictures"] if size > 0][:3] == ["main", "view_0", "policy"]
    assert len(header["targets"]) == 4


def test_next_and_again_lead_to_the_next_target_and_to_a_fresh_start(pair):
    robot, teleoperator, page = pair

    def press(kind):
        page.say(kind=kind)
        page.hold(CENTRE)
        robot.send_action(teleoperator.get_action())
        return robot.scene_id, robot.target_id, robot.episode_count

    assert press("next") == (0, 1, 2)
    assert press("again") == (0, 1, 3)
    page.hold([-1.0, 0.0, 0.0, 0.0])
    page.say(kind="stop")
    page.hold([-1.0, 0.0, 0.0, 0.0])
    assert teleoperator.get_action() == pytest.approx(
        dict(zip(robot.task_spec.action_names, robot.env.holding_action().tolist(), strict=True)), abs=1e-6
    )


def test_a_recording_by_the_page_is_one_of_a_person(pair, caplog):
    robot, teleoperator, page = pair
    caplog.set_level(logging.INFO)  # as LeRobot's commands do
    logging.info("Recording episode 0")
    for _ in range(3):
        page.hold([-1.0, 0.0, 0.0, 0.0])
        robot.send_action(teleoperator.get_action())
    logging.info("Stop recording")
    (episode,) = read_session(robot.config.session_log).values()
    assert (episode.frames, episode.operator) == (3, "person")


def test_a_page_that_is_gone_lets_go(pair):
    robot, teleoperator, page = pair
    page.hold([-1.0, 0.0, 0.0, 0.0])
    page.close()
    deadline = time.monotonic() + 10.0
    while teleoperator._seat.driver is not None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    action = list(teleoperator.get_action().values())
    np.testing.assert_allclose(action, robot.env.holding_action(), atol=1e-6)


def test_misuse_says_what_to_do(tmp_path):
    config = TeleoperatorConfig.get_choice_class("excavator_web")
    teleoperator = make_teleoperator_from_config(config(calibration_dir=tmp_path, port=0))
    with pytest.raises(DeviceError, match="not served; call connect"):
        teleoperator.get_action()
    with pytest.raises(DeviceError, match="not served"):
        teleoperator.disconnect()
    teleoperator.connect()
    with pytest.raises(DeviceError, match="0 robots of type excavator_sim"):
        teleoperator.get_action()
    with pytest.raises(DeviceError, match="served already, at http"):
        teleoperator.connect()
    taken = int(teleoperator.address.split(":")[2].partition("/")[0])
    other = make_teleoperator_from_config(config(calibration_dir=tmp_path, port=taken))
    with pytest.raises(DeviceError, match="give another --port"):
        other.connect()
    teleoperator.disconnect()
    assert not teleoperator.is_connected
