"""What LeRobot announces decides where episodes of any robot begin and what the session log holds."""

import json
import logging

import pytest

pytestmark = pytest.mark.usefixtures("announcements_are_heard")


def lines_of(robot, *fields):
    """Return the lines of a robot's session log, or some of their fields."""
    path = robot.config.session_log
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return [tuple(line[field] for field in fields) for line in lines] if fields else lines


@pytest.mark.parametrize(
    ("settings", "presses", "visited"),
    [
        ({"scene_id": 1, "target_id": 2}, (), [(1, 2, 0), (1, 3, 0), (2, 0, 0)]),
        ({}, (1,), [(0, 0, 0), (0, 2, 0), (0, 3, 0)]),  # a press leaves one target out
        ({"advance": "button"}, (2,), [(0, 0, 0), (0, 0, 0), (0, 1, 0)]),
    ],
)
def test_every_recorded_episode_has_the_scene_and_target_that_settings_and_presses_give_it(
    make_robot, record_episode, still, settings, presses, visited
):
    robot = make_robot(**settings)
    for index, expected in enumerate(visited):
        if index in presses:
            robot.send_action(still | {"next_scene": 1.0})
        assert record_episode(robot, index) == expected


def test_recording_again_repeats_the_scene(make_robot, record_episode):
    robot = make_robot()
    record_episode(robot, 0)
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Re-record episode")
    assert record_episode(robot, 1, frames=5) == (0, 1, 0)
    logging.info("Stop recording")
    assert lines_of(robot, "episode_index", "frames") == [(0, 2), (1, 5)]


def test_the_session_log_describes_each_episode(make_robot, record_episode):
    robot = make_robot(scene_set="val", scene_id=3, fps=25, observation_width=160)
    record_episode(robot, 0, frames=4)
    assert lines_of(robot) == []
    robot.disconnect()
    expected = {
        "episode_index": 0,
        "simulation_version": robot.task_spec.simulation_version,
        "env": robot.task_spec.env_type,
        "settings": robot.settings.as_dict(),
        "scene_id": 3,
        "commands": [[0, 0]],
        "frames": 4,
        "restarts": [],
    }
    assert lines_of(robot) == [expected]
    assert expected["settings"].items() >= {"scene_set": "val", "fps": 25, "observation_width": 160}.items()


def test_restarts_within_an_episode_are_noted(make_robot, still):
    robot = make_robot()
    logging.info("Recording episode 0")
    for _ in range(2):
        robot.send_action(still | {"reinitialise": 1.0})  # LeRobot records this frame too
        robot.send_action(still)
    logging.info("Stop recording")
    assert lines_of(robot, "frames", "restarts") == [(2, [0, 1])]


def test_a_robot_driven_home_between_episodes_starts_the_next_one_afresh(make_robot, record_episode):
    robot = make_robot()
    record_episode(robot, 0)
    home = {name: value for name, value in robot.get_observation().items() if name.endswith(".pos")}
    for _ in range(3):
        robot.send_action(home)
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Stop recording")
    assert lines_of(robot, "frames", "restarts") == [(2, []), (2, [])]


def test_a_discarded_last_episode_is_not_logged(make_robot, record_episode):
    robot = make_robot()
    record_episode(robot, 0)
    logging.info("Re-record episode")
    logging.info("Stop recording")
    assert lines_of(robot) == []


def test_only_lerobot_itself_is_believed_and_only_by_a_connected_robot(make_robot):
    robot = make_robot()
    resets = robot.episode_count
    logging.getLogger("elsewhere").info("Recording episode 3")
    logging.info("Recording episode three")
    logging.info("Recording episode 3 of 5")
    robot.disconnect()
    logging.info("Recording episode 0")
    assert robot.episode_count == resets
    assert lines_of(robot) == []
