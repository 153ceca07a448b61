"""What LeRobot announces decides where episodes begin and what the session log holds."""

import json
import logging
from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Any

import pytest

from lerobot_excav.envs.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.envs.simulation_version import SIMULATION_VERSION
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.robots.session_log import SessionLog, default_path

MakeRobot = Callable[..., ExcavatorSim]
STILL = dict.fromkeys(ACTION_NAMES, 0.0)


@pytest.fixture(autouse=True)
def announcements_are_heard() -> Iterator[None]:
    """Set the root logger's level as LeRobot's commands do."""
    level = logging.getLogger().level
    logging.getLogger().setLevel(logging.NOTSET)
    yield
    logging.getLogger().setLevel(level)


def record_episode(robot: ExcavatorSim, index: int, *, frames: int = 2) -> tuple[int, ...]:
    """Play LeRobot's part of an episode; return its scene, target and steps before its first frame."""
    logging.info(f"Recording episode {index}")
    first = robot.get_observation()
    for _ in range(frames):
        robot.send_action(STILL)
    logging.info("Reset the environment")
    robot.send_action(STILL)
    return tuple(int(first[name]) for name in STATE_NAMES[:3])


def lines_of(robot: ExcavatorSim) -> list[dict[str, Any]]:
    path = robot.config.session_log
    assert path is not None
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def test_every_recorded_episode_has_its_own_scene_and_target(make_robot: MakeRobot) -> None:
    robot = make_robot(scene_id=1, target_id=2)
    assert [record_episode(robot, i) for i in range(3)] == [(1, 2, 0), (1, 3, 0), (2, 0, 0)]


def test_recording_again_repeats_the_scene(make_robot: MakeRobot) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Re-record episode")
    assert record_episode(robot, 1, frames=5) == (0, 1, 0)
    logging.info("Stop recording")
    assert [(line["episode_index"], line["frames"]) for line in lines_of(robot)] == [(0, 2), (1, 5)]


def test_a_resumed_recording_goes_on_where_it_stopped(make_robot: MakeRobot) -> None:
    assert record_episode(make_robot(), 6) == (1, 2, 0)


def test_with_buttons_only_the_scene_stays_until_a_press(make_robot: MakeRobot) -> None:
    robot = make_robot(advance="button")
    assert [record_episode(robot, i) for i in range(2)] == [(0, 0, 0), (0, 0, 0)]
    robot.send_action(STILL | {"next_scene": 1.0})
    assert record_episode(robot, 2) == (0, 1, 0)


def test_a_press_leaves_one_target_out(make_robot: MakeRobot) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    robot.send_action(STILL | {"next_scene": 1.0})
    assert [record_episode(robot, i) for i in (1, 2)] == [(0, 2, 0), (0, 3, 0)]


def test_the_session_log_describes_each_episode(make_robot: MakeRobot) -> None:
    robot = make_robot(
        scene_set="val", scene_id=3, fps=25, soil="gravel", fidelity="fast", observation_width=160
    )
    record_episode(robot, 0, frames=4)
    assert lines_of(robot) == []
    robot.disconnect()
    assert lines_of(robot) == [
        {
            "episode_index": 0,
            "simulation_version": SIMULATION_VERSION,
            "scene_set": "val",
            "scene_id": 3,
            "target_id": 0,
            "fps": 25,
            "soil": "gravel",
            "fidelity": "fast",
            "observation_height": 96,
            "observation_width": 160,
            "task": "Scoop-v0",
            "frames": 4,
            "restarts": [],
        }
    ]


def test_restarts_within_an_episode_are_noted(make_robot: MakeRobot) -> None:
    robot = make_robot()
    logging.info("Recording episode 0")
    robot.send_action(STILL | {"reinitialise": 1.0})  # LeRobot records this frame too
    robot.send_action(STILL)
    robot.send_action(STILL | {"reinitialise": 1.0})
    robot.send_action(STILL)
    logging.info("Stop recording")
    assert [(line["frames"], line["restarts"]) for line in lines_of(robot)] == [(2, [0, 1])]


def test_a_discarded_last_episode_is_not_logged(make_robot: MakeRobot) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    logging.info("Re-record episode")
    logging.info("Stop recording")
    assert lines_of(robot) == []


def test_only_lerobot_itself_is_believed(make_robot: MakeRobot) -> None:
    robot = make_robot()
    resets = robot.episode_count
    logging.getLogger("elsewhere").info("Recording episode 3")
    logging.info("Recording episode three")
    logging.info("Recording episode 3 of 5")
    assert robot.episode_count == resets


def test_a_disconnected_robot_no_longer_listens(make_robot: MakeRobot) -> None:
    robot = make_robot()
    robot.disconnect()
    logging.info("Recording episode 0")
    assert lines_of(robot) == []


def test_by_default_the_log_is_where_lerobot_puts_its_outputs() -> None:
    path = default_path("excavator_sessions", datetime(2026, 1, 2, 3, 4, 5))
    assert path.as_posix() == "outputs/excavator_sessions/2026-01-02_03-04-05.jsonl"


def test_a_log_that_cannot_be_written_is_an_error(tmp_path: Any) -> None:
    (tmp_path / "file").write_text("")
    log = SessionLog(tmp_path / "file" / "session.jsonl", {})
    log.begin(0, scene_id=0, target_id=0)
    with pytest.raises(DeviceError, match=r"robot\.session_log=.*cannot be written"):
        log.write()
