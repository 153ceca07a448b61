"""Where a session is logged, and what a crash leaves of the log."""

from datetime import datetime

import pytest

from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.session_log import SessionLog, default_path

STATE, ACTION = [0.0] * 8, [0.5] * 4


@pytest.fixture
def log(tmp_path):
    log = SessionLog(tmp_path / "folder" / "session.jsonl", SCOOP, SCOOP.make_settings())
    log.start()
    yield log
    log.close()


def record(log, index, *, targets=(0, 0)):
    log.begin(index, scene_id=0, target_id=targets[0])
    for target_id in targets[1:]:
        log.note_action(STATE, ACTION, target_id)


def ends_of(path):
    return {index: (episode.frames, episode.end) for index, episode in read_session(path).items()}


def test_by_default_the_log_is_where_lerobot_puts_its_outputs():
    path = default_path("excavator_sim_sessions", datetime(2026, 1, 2, 3, 4, 5))
    assert path.as_posix() == "outputs/excavator_sim_sessions/2026-01-02_03-04-05.jsonl"


def test_a_command_after_the_last_action_is_none(log):
    record(log, 0, targets=(0, 0, 2, 2, 1))
    assert read_session(log.path)[0].schedule == ((2, 2),)


def test_a_command_that_names_a_target_of_the_same_number_again_is_noted(log):
    log.begin(0, scene_id=0, target_id=0)
    for since in (0, 0, 3, 3, 3):
        log.note_action(STATE, ACTION, 0, since)
    assert read_session(log.path)[0].schedule == ((3, 0),)


def test_wherever_a_crash_cuts_the_log_off_only_the_last_line_is_lost_and_the_next_session_goes_on(log):
    record(log, 0)
    log.end()
    record(log, 1, targets=(1, 1, 1))
    whole = log.path.read_bytes()
    start = whole.rindex(b"\n", 0, -1) + 1
    for size in range(start, len(whole) - 1):
        log.close()
        log.path.write_bytes(whole[:size])
        assert ends_of(log.path) == {0: (1, "ended"), 1: (1, None)}
        log.start()
        record(log, 1, targets=(2, 2))
        log.stop()
        assert ends_of(log.path) == {0: (1, "ended"), 1: (1, "stopped")}
        assert log.path.read_bytes().startswith(whole[:size])


def test_an_episode_replaces_those_that_lerobot_did_not_keep(log):
    for index in (0, 1, 2, 1):
        record(log, index, targets=(0, *[0] * (index + 1)))
        log.end()
    assert ends_of(log.path) == {0: (1, "ended"), 1: (2, "ended")}
    log.discard()
    assert list(ends_of(log.path)) == [0]


def test_two_robots_do_not_mix_their_sessions_in_one_log(log):
    second = SessionLog(log.path, SCOOP, SCOOP.make_settings())
    second.start()
    record(log, 0)
    written = log.path.read_bytes()
    with pytest.raises(DeviceError, match=r"another process is at work on \S*session\.jsonl.*give another file"):
        record(second, 0)
    assert log.path.read_bytes() == written
    log.close()
    record(second, 0)
    second.close()
    assert list(log.path.parent.iterdir()) == [log.path]


def test_a_finished_episode_is_on_the_disk_before_the_next_begins(log, monkeypatch):
    synced = []
    monkeypatch.setattr("os.fsync", lambda _: synced.append(log.path.read_text().splitlines()[-1]))
    record(log, 0)
    log.end()
    assert synced == ['{"event": "ended", "frames": 1}']


def test_an_arm_whose_episodes_others_end_may_change_its_command_late():
    assert FR5SimConfig(id="arm", retarget_frame=500).retarget_frame == 500
