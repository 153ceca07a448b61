"""What LeRobot announces decides where episodes of any robot begin and what the session log holds."""

import json
import logging
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from lerobot_excav.robots.simulated_robot import SimulatedRobot

MakeRobot = Callable[..., SimulatedRobot[Any]]
Action = dict[str, float]
RecordEpisode = Callable[..., tuple[int, ...]]


@pytest.fixture(autouse=True)
def announcements_are_heard() -> Iterator[None]:
    """Set the root logger's level as LeRobot's commands do."""
    level = logging.getLogger().level
    logging.getLogger().setLevel(logging.NOTSET)
    yield
    logging.getLogger().setLevel(level)


@pytest.fixture
def record_episode(still: Action) -> RecordEpisode:
    """Play LeRobot's part of an episode; return its scene, target and steps before its first frame."""

    def _record(robot: SimulatedRobot[Any], index: int, *, frames: int = 2) -> tuple[int, ...]:
        logging.info(f"Recording episode {index}")
        first = robot.get_observation()
        for _ in range(frames):
            robot.send_action(still)
        logging.info("Reset the environment")
        robot.send_action(still)
        return tuple(int(first[name]) for name in robot.state_names[:3])

    return _record


def lines_of(robot: SimulatedRobot[Any]) -> list[dict[str, Any]]:
    path = robot.config.session_log
    assert path is not None
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def test_every_recorded_episode_has_its_own_scene_and_target(
    make_robot: MakeRobot, record_episode: RecordEpisode
) -> None:
    robot = make_robot(scene_id=1, target_id=2)
    assert [record_episode(robot, i) for i in range(3)] == [(1, 2, 0), (1, 3, 0), (2, 0, 0)]


def test_recording_again_repeats_the_scene(make_robot: MakeRobot, record_episode: RecordEpisode) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Re-record episode")
    assert record_episode(robot, 1, frames=5) == (0, 1, 0)
    logging.info("Stop recording")
    assert [(line["episode_index"], line["frames"]) for line in lines_of(robot)] == [(0, 2), (1, 5)]


def test_a_resumed_recording_goes_on_where_it_stopped(make_robot: MakeRobot, record_episode: RecordEpisode) -> None:
    assert record_episode(make_robot(), 6) == (1, 2, 0)


def test_with_buttons_only_the_scene_stays_until_a_press(
    make_robot: MakeRobot, record_episode: RecordEpisode, still: Action
) -> None:
    robot = make_robot(advance="button")
    assert [record_episode(robot, i) for i in range(2)] == [(0, 0, 0), (0, 0, 0)]
    robot.send_action(still | {"next_scene": 1.0})
    assert record_episode(robot, 2) == (0, 1, 0)


def test_a_press_leaves_one_target_out(make_robot: MakeRobot, record_episode: RecordEpisode, still: Action) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    robot.send_action(still | {"next_scene": 1.0})
    assert [record_episode(robot, i) for i in (1, 2)] == [(0, 2, 0), (0, 3, 0)]


def test_the_session_log_describes_each_episode(make_robot: MakeRobot, record_episode: RecordEpisode) -> None:
    robot = make_robot(scene_set="val", scene_id=3, fps=25, observation_width=160)
    record_episode(robot, 0, frames=4)
    assert lines_of(robot) == []
    robot.disconnect()
    assert lines_of(robot) == [
        {
            "episode_index": 0,
            "simulation_version": robot.simulation_version,
            "scene_set": "val",
            "scene_id": 3,
            "target_id": 0,
            "fps": 25,
            "observation_height": 96,
            "observation_width": 160,
            "task": robot.config.task,
            **robot.describe_simulation(),
            "frames": 4,
            "restarts": [],
        }
    ]


def test_restarts_within_an_episode_are_noted(make_robot: MakeRobot, still: Action) -> None:
    robot = make_robot()
    logging.info("Recording episode 0")
    robot.send_action(still | {"reinitialise": 1.0})  # LeRobot records this frame too
    robot.send_action(still)
    robot.send_action(still | {"reinitialise": 1.0})
    robot.send_action(still)
    logging.info("Stop recording")
    assert [(line["frames"], line["restarts"]) for line in lines_of(robot)] == [(2, [0, 1])]


def test_a_robot_driven_home_between_episodes_starts_the_next_one_afresh(
    make_robot: MakeRobot, record_episode: RecordEpisode
) -> None:
    robot = make_robot()
    record_episode(robot, 0)
    observation = robot.get_observation()
    for _ in range(3):
        robot.send_action({name: observation[name] for name in robot.state_names if name.endswith(".pos")})
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Stop recording")
    assert [(line["frames"], line["restarts"]) for line in lines_of(robot)] == [(2, []), (2, [])]


def test_a_discarded_last_episode_is_not_logged(make_robot: MakeRobot, record_episode: RecordEpisode) -> None:
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
