"""What LeRobot announces decides where episodes of any robot begin and what the session log holds."""

import json
import logging

import pytest

from lerobot_excav.errors import ConfigurationError


@pytest.fixture(autouse=True)
def announcements_are_heard():
    """Set the root logger's level as LeRobot's commands do."""
    level = logging.getLogger().level
    logging.getLogger().setLevel(logging.NOTSET)
    yield
    logging.getLogger().setLevel(level)


@pytest.fixture
def record_episode(still):
    """Play LeRobot's part of an episode; return its scene, target and steps before its first frame."""

    def _record(robot, index, *, frames=2):
        logging.info(f"Recording episode {index}")
        first = robot.get_observation()
        for _ in range(frames):
            robot.send_action(still)
        logging.info("Reset the environment")
        robot.send_action(still)
        return tuple(int(first[name]) for name in robot.task_spec.state_names[:3])

    return _record


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


@pytest.mark.parametrize(
    ("settings", "within", "between", "shown"),
    [
        ({}, 1, 0, (0, 1, 0)),  # as it began, and as documented
        ({}, 0, 1, (0, 2, 0)),  # left out while the scene was reset
        ({}, 2, 1, (0, 2, 0)),
        ({"advance": "button"}, 1, 0, (0, 0, 0)),
        ({"advance": "button"}, 1, 1, (0, 1, 0)),
    ],
)
def test_recording_again_forgets_the_presses_within_the_episode_and_keeps_those_behind_it(
    make_robot, record_episode, still, settings, within, between, shown
):
    robot = make_robot(**settings)
    record_episode(robot, 0)
    logging.info("Recording episode 1")
    for _ in range(within):
        robot.send_action(still | {"next_scene": 1.0})
    robot.send_action(still)
    logging.info("Reset the environment")
    for _ in range(between):
        robot.send_action(still | {"next_scene": 1.0})
    logging.info("Re-record episode")
    assert record_episode(robot, 1) == shown
    logging.info("Stop recording")
    assert lines_of(robot, "episode_index", "restarts") == [(0, []), (1, [])]


def test_a_press_within_an_episode_does_not_move_the_targets_of_later_ones(make_robot, record_episode, still):
    robot = make_robot()
    logging.info("Recording episode 0")
    robot.send_action(still | {"next_scene": 1.0})
    assert record_episode(robot, 1) == (0, 1, 0)


@pytest.mark.parametrize(
    ("settings", "presses", "shown"),
    [
        ({"scene_id": 2, "target_id": 1}, (), [(2, 1, 0), (2, 2, 0), (2, 3, 0)]),
        ({}, (1,), [(0, 0, 0), (0, 2, 0), (0, 3, 0)]),  # no pair is recorded twice
        ({"advance": "button"}, (1,), [(0, 0, 0), (0, 1, 0), (0, 1, 0)]),
    ],
)
def test_a_resumed_recording_goes_on_behind_the_last_episode_of_its_session_log(
    make_robot, record_episode, still, settings, presses, shown
):
    robot = make_robot(**settings)
    for index in range(2):
        if index in presses:
            robot.send_action(still | {"next_scene": 1.0})
        assert record_episode(robot, index) == shown[index]
    robot.disconnect()  # the second session is a robot of its own
    assert record_episode(make_robot(**settings), 2) == shown[2]


def test_an_episode_that_an_interruption_kept_out_of_the_dataset_is_recorded_again(make_robot, record_episode):
    robot = make_robot()
    for index in range(3):
        record_episode(robot, index)
    robot.disconnect()  # the last line is there, the last episode is not
    assert record_episode(make_robot(), 2) == (0, 2, 0)


@pytest.mark.parametrize(
    ("lines", "settings", "message"),
    [
        (None, {}, r"has 2 episodes already.* lacks all of them.*--robot\.session_log=FILE"),
        ([0], {}, r"lacks episodes \[1\].*--robot\.session_log=FILE"),
        ([1, "rubbish"], {}, r"lacks episodes \[0\]"),
        ([0, 1], {"scene_id": 5}, r"began with scene 0 and target 0.*--robot\.scene_id=0 --robot\.target_id=0"),
    ],
)
def test_a_resumed_recording_that_its_session_log_does_not_hold_is_refused(
    make_robot, tmp_path, lines, settings, message
):
    if lines is not None:
        line = {"scene_id": 0, "commands": [[0, 0]]}
        texts = [json.dumps(line | {"episode_index": each}) if isinstance(each, int) else each for each in lines]
        (tmp_path / "session.jsonl").write_text("\n".join(texts))
    make_robot(**settings)
    with pytest.raises(ConfigurationError, match=message):
        logging.info("Recording episode 2")


def sentry(message, logger="lerobot.rollout.strategies.sentry"):
    logging.getLogger(logger).info(message)


def test_a_run_that_lerobot_cuts_into_episodes_starts_afresh_at_every_cut(make_robot, still):
    robot = make_robot()
    sentry("Dataset ready: someone/data (0 existing episodes)", "lerobot.rollout.context")
    sentry("Sentry recording started (episode_duration=300s)")
    for frames in (3, 2):
        for _ in range(frames):
            robot.send_action(still)
        if frames == 3:
            logging.info("Episode 1 saved")
            observation = robot.get_observation()
            assert [observation[name] for name in robot.task_spec.state_names[:3]] == [0.0, 1.0, 0.0]
    sentry("Sentry control loop ended — saving final episode")
    sentry("Stopping sentry recording")
    assert lines_of(robot, "episode_index", "frames", "commands") == [(0, 3, [[0, 0]]), (1, 2, [[0, 1]])]


def test_other_strategies_save_episodes_that_are_not_believed(make_robot, still):
    robot = make_robot()
    resets = robot.episode_count
    logging.info("Episode 1 saved")
    assert robot.episode_count == resets


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
