"""`lerobot-record`, `lerobot-excav index` and `lerobot-replay`, run for real with the scripted operator."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.scripts import lerobot_record, lerobot_replay

from lerobot_excav.robots.fr5_sim.fr5_sim import FR5Sim
from lerobot_excav.scripts import main

pytestmark = pytest.mark.slow

ROBOT = ["--robot.type=fr5_sim", "--robot.observation_height=48", "--robot.observation_width=64"]
RECORD = [
    *("--teleop.type=fr5_operator", "--dataset.fps=50", "--dataset.single_task=grasp"),
    *("--dataset.episode_time_s=0.6", "--dataset.reset_time_s=0.1", "--dataset.num_episodes=2"),
    *("--dataset.video=false", "--dataset.push_to_hub=false", "--dataset.no_stamp=true"),
    *("--robot.scene_id=6", "--robot.target_id=3", "--robot.scene_set=val", "--robot.retarget_frame=3"),
]


def test_a_recording_is_completed_and_repeated_bit_for_bit(
    run_command: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_command(lerobot_record.main, *ROBOT, f"--teleop.calibration_dir={tmp_path}", *RECORD)
    session = [json.loads(line) for line in (tmp_path / "session.jsonl").read_text().splitlines()]
    assert [(each["env"], each["scene_id"], each["commands"][0]) for each in session] == [
        ("fr5_grasp", 6, [0, 3]),
        ("fr5_grasp", 7, [0, 0]),
    ]
    (changed_at, second), *_ = session[1]["commands"][1:]
    assert changed_at == 3
    assert main.main(["index", str(tmp_path / "data"), f"--session={tmp_path / 'session.jsonl'}"]) == 0
    dataset = LeRobotDataset("someone/data", root=tmp_path / "data")
    rows = [row for row in (dataset[i] for i in range(len(dataset))) if row["episode_index"] == 1]
    assert len(rows) == session[1]["frames"] > 5
    assert rows[0]["excav.pair_uid"] == "fr5_grasp/val/7/0"
    assert [int(row["excav.target_id"]) for row in rows] == [0] * 3 + [second] * (len(rows) - 3)
    assert main.main(["qc", str(tmp_path / "data"), "--replays=2"]) == 0
    assert dataset.meta.robot_type == "fr5_sim"

    states = []
    send_action = FR5Sim.send_action

    def watched(robot: FR5Sim, action: Any) -> Any:
        observation = robot.get_observation()
        states.append(np.array([observation[name] for name in robot.task_spec.state_names], np.float32))
        return send_action(robot, action)

    monkeypatch.setattr(FR5Sim, "send_action", watched)
    where = ["--robot.scene_set=val", "--robot.scene_id=7", "--robot.target_id=0"]
    run_command(lerobot_replay.main, *ROBOT, *where, "--dataset.episode=1")
    assert np.array_equal(np.stack(states), np.stack([row["observation.state"].numpy() for row in rows]))
