"""Which scene and target an episode shows: presses, recording again, resuming, and a run that is cut into episodes."""

import json
import logging

import pytest

from lerobot_excav.envs.tasks.selection import TargetAbsentError
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.target_order import logged_starts

pytestmark = pytest.mark.usefixtures("announcements_are_heard")


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
    assert logged_starts(robot.config.session_log) == {0: (0, 0, 0), 1: (shown[0], 0, shown[1])}


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
        ([1, "rubbish", "[]"], {}, r"lacks episodes \[0\]"),
        ([0, 1], {"scene_id": 5}, r"began with scene 0 and target 0.*--robot\.scene_id=0 --robot\.target_id=0"),
    ],
)
def test_a_resumed_recording_that_its_session_log_does_not_hold_is_refused(
    make_robot, tmp_path, lines, settings, message
):
    if lines is not None:
        line = {"event": "episode", "scene_id": 0, "stage": 0, "target_id": 0}
        texts = [json.dumps(line | {"episode_index": each}) if isinstance(each, int) else each for each in lines]
        (tmp_path / "session.jsonl").write_text("\n".join(['{"event": "session"}', *texts]))
    make_robot(**settings)
    with pytest.raises(ConfigurationError, match=message):
        logging.info("Recording episode 2")


def test_a_line_of_a_session_log_that_cannot_be_read_counts_as_none(tmp_path):
    path = tmp_path / "session.jsonl"
    line = {"event": "episode", "episode_index": 0, "scene_id": 3, "stage": 0, "target_id": 1}
    wrong = [line | {"scene_id": "3"}, line | {"target_id": None}, line | {"episode_index": [0]}]
    whole = json.dumps(line).encode()
    path.write_bytes(b"\n".join([whole, b"\xff\x00", *(json.dumps(each).encode() for each in wrong), whole[:30]]))
    assert logged_starts(path) == {0: (3, 0, 1)}


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
    robot.disconnect()
    assert logged_starts(robot.config.session_log) == {0: (0, 0, 0), 1: (0, 0, 1)}


def test_other_strategies_save_episodes_that_are_not_believed(make_robot, still):
    robot = make_robot()
    resets = robot.episode_count
    logging.info("Episode 1 saved")
    assert robot.episode_count == resets


def test_a_target_that_a_start_does_not_offer_is_left_out_for_good(make_robot, record_episode, still, monkeypatch):
    robot = make_robot()
    count = robot.task_spec.starts_per_scene
    if count == 1:
        pytest.skip("its task chooses targets itself")
    reset = robot.env.reset

    def poorer(*, options):
        if options["target_id"] >= count - 2:  # the last two
            raise TargetAbsentError("two regions here")
        return reset(options=options)

    monkeypatch.setattr(robot.env, "reset", poorer)
    shown = [record_episode(robot, index)[:2] for index in range(2 * count - 4 + 1)]
    present = [(scene, target) for scene in range(3) for target in range(count - 2)]
    assert shown == present[: len(shown)]
    logging.info("Stop recording")
    robot.disconnect()
    again = make_robot()
    monkeypatch.setattr(again.env, "reset", poorer)
    assert record_episode(again, len(shown))[:2] == present[len(shown)]


def test_a_recording_resumed_at_another_stage_is_refused(make_robot, record_episode):
    robot = make_robot()
    last = robot.task_spec.last_stage
    record_episode(robot, 0)
    logging.info("Stop recording")
    robot.disconnect()
    if last == 0:
        return  # there is no other stage
    with pytest.raises(ConfigurationError, match=r"began with scene 0, stage 0 and target 0.*--robot\.stage=0"):
        record_episode(make_robot(stage=last), 1)
