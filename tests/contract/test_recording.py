"""What LeRobot announces decides where episodes of any robot begin and what the session log holds."""

import logging
from pathlib import Path

import numpy as np
import pytest

from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.errors import DeviceError

pytestmark = pytest.mark.usefixtures("announcements_are_heard")


def logged(robot, *fields):
    """Return some fields of the episodes in a robot's session log."""
    path = robot.config.session_log
    episodes = read_session(path).values() if path.exists() else []
    return [tuple(getattr(episode, field) for field in fields) for episode in episodes]


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
    assert logged(robot, "episode_index", "frames", "end") == [(0, 2, "ended"), (1, 5, "ended")]


def test_the_session_log_describes_each_episode(make_robot, record_episode):
    robot = make_robot(scene_set="val", scene_id=3, fps=25, observation_width=160)
    record_episode(robot, 0, frames=4)
    (episode,) = read_session(robot.config.session_log).values()  # already, while the robot runs
    robot.disconnect()
    assert (episode.env, episode.simulation_version) == (
        robot.task_spec.env_type,
        robot.task_spec.simulation_version,
    )
    assert episode.task_settings == robot.settings
    assert (episode.pair.scene_set, episode.pair.scene_id, episode.pair.target_id) == ("val", 3, 0)
    assert (episode.frames, episode.restarts, episode.schedule, episode.end) == (4, [], (), "ended")


def test_the_stage_of_the_robot_reaches_environment_and_log(make_robot, new_robot, record_episode):
    last = new_robot().task_spec.last_stage
    robot = make_robot(stage=last)
    record_episode(robot, 0)
    robot.send_action({"reinitialise": 1.0})
    assert robot.env.options == {"scene_id": 0, "stage": last, "target_id": 0}
    logging.info("Stop recording")
    assert [episode.pair.stage for episode in read_session(robot.config.session_log).values()] == [last]


def test_who_drives_is_noted_once_an_episode_and_only_within_one(make_robot, still):
    robot = make_robot()
    robot.note_operator("scripted")
    for index in range(2):
        logging.info(f"Recording episode {index}")
        for _ in range(2):
            if index == 0:
                robot.note_operator("scripted")
            robot.send_action(still)
        logging.info("Reset the environment")
    assert logged(robot, "episode_index", "operator") == [(0, "scripted"), (1, None)]
    assert robot.config.session_log.read_text().count('"operator"') == 2  # one line, with event and value


def test_restarts_within_an_episode_are_noted(make_robot, still):
    robot = make_robot()
    logging.info("Recording episode 0")
    for _ in range(2):
        robot.send_action(still | {"reinitialise": 1.0})  # LeRobot records this frame too
        robot.send_action(still)
    logging.info("Stop recording")
    assert logged(robot, "frames", "restarts") == [(2, [0, 1])]
    (episode,) = read_session(robot.config.session_log).values()
    assert [len(run.frames) for run in episode.runs] == [1, 2, 1]


def test_a_robot_driven_home_between_episodes_starts_the_next_one_afresh(make_robot, record_episode):
    robot = make_robot()
    record_episode(robot, 0)
    home = {name: value for name, value in robot.get_observation().items() if name.endswith(".pos")}
    for _ in range(3):
        robot.send_action(home)
    assert record_episode(robot, 1) == (0, 1, 0)
    logging.info("Stop recording")
    assert logged(robot, "frames", "restarts") == [(2, []), (2, [])]


def test_a_discarded_last_episode_is_not_logged(make_robot, record_episode):
    robot = make_robot()
    record_episode(robot, 0)
    logging.info("Re-record episode")
    logging.info("Stop recording")
    assert logged(robot) == []


def test_only_lerobot_itself_is_believed_and_only_by_a_connected_robot(make_robot):
    robot = make_robot()
    resets = robot.episode_count
    logging.getLogger("elsewhere").info("Recording episode 3")
    logging.info("Recording episode three")
    logging.info("Recording episode 3 of 5")
    robot.disconnect()
    logging.info("Recording episode 0")
    assert robot.episode_count == resets
    assert not robot.config.session_log.exists()


def test_every_frame_is_in_the_log_before_the_next_one_exactly_as_lerobot_records_it(make_robot, still, rng):
    robot = make_robot()
    logging.info("Recording episode 0")
    for number in range(3):
        state = [robot.get_observation()[name] for name in robot.task_spec.state_names]
        # Beyond the limits too: LeRobot records what the device sent, not what was carried out.
        action = dict(zip(still, (rng.normal(size=len(still)) * 3.0).tolist(), strict=True))
        robot.send_action(action)
        (episode,) = read_session(robot.config.session_log).values()
        frame = episode.runs[0].frames[number]
        assert np.array_equal(np.array(frame.action, np.float32), np.array(list(action.values()), np.float32))
        assert frame.state == state


def test_a_frame_in_which_the_scene_was_restarted_is_in_the_log_with_the_new_start(make_robot, still):
    robot = make_robot(target_id=1)
    logging.info("Recording episode 0")
    robot.send_action(still)
    robot.send_action(still | {"next_scene": 1.0})
    robot.send_action({"reinitialise": 1.0})  # without commands, LeRobot has no frame
    (episode,) = read_session(robot.config.session_log).values()
    assert [(run.target_id, len(run.frames)) for run in episode.runs] == [(1, 2), (2, 0), (2, 0)]
    assert episode.runs[0].frames[1].action == list(still.values())


def test_a_log_that_cannot_be_written_is_told_when_the_robot_connects(new_robot, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "thesis.txt").write_text("A thesis.\n")
    for path, message in [
        (tmp_path / "file" / "session.jsonl", "cannot be written"),
        (tmp_path, "cannot be written .*directory"),
        (tmp_path / "thesis.txt", "exists and does not begin like a session log .*stays as it is"),
    ]:
        robot = new_robot(session_log=path)
        with pytest.raises(DeviceError, match=rf"robot\.session_log=.*{message}"):
            robot.connect()
        assert not robot.is_connected
    assert (tmp_path / "thesis.txt").read_text() == "A thesis.\n"


def test_a_full_disk_is_named(make_robot):
    robot = make_robot(session_log=Path("/dev/full"))
    with pytest.raises(DeviceError, match=r"robot\.session_log='/dev/full' cannot be written \(No space left"):
        logging.info("Recording episode 0")
    robot.disconnect()


def test_a_log_in_which_nothing_was_noted_is_not_left_behind(make_robot, still, tmp_path):
    robot = make_robot(session_log=tmp_path / "new.jsonl")
    robot.send_action(still)
    robot.disconnect()
    assert not (tmp_path / "new.jsonl").exists()
    (tmp_path / "mine.jsonl").touch()
    make_robot(session_log=tmp_path / "mine.jsonl").disconnect()
    assert (tmp_path / "mine.jsonl").exists()
