"""Where a session is logged, and what happens where it cannot be."""

import json
from datetime import datetime

import pytest

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.session_log import SessionLog, default_path


def test_by_default_the_log_is_where_lerobot_puts_its_outputs():
    path = default_path("excavator_sim_sessions", datetime(2026, 1, 2, 3, 4, 5))
    assert path.as_posix() == "outputs/excavator_sim_sessions/2026-01-02_03-04-05.jsonl"


def test_a_log_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    log = SessionLog(tmp_path / "file" / "session.jsonl", SCOOP, SCOOP.make_settings())
    log.begin(0, scene_id=0, target_id=0)
    with pytest.raises(DeviceError, match=r"robot\.session_log=.*cannot be written"):
        log.write()


def test_a_command_after_the_last_action_is_not_logged(tmp_path):
    log = SessionLog(tmp_path / "session.jsonl", SCOOP, SCOOP.make_settings())
    log.begin(0, scene_id=0, target_id=0)
    for target_id in (0, 2, 2, 1):
        log.count_frame(target_id)
    log.write()
    assert json.loads(log.path.read_text())["commands"] == [[0, 0], [2, 2]]


def test_an_arm_whose_episodes_others_end_may_change_its_command_late():
    assert FR5SimConfig(id="arm", retarget_frame=500).retarget_frame == 500
