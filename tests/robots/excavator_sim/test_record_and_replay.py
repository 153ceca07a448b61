"""`lerobot-record` and `lerobot-replay`, run for real with the scripted operator.

These tests would notice if a new version of LeRobot announced the phases of a recording in other words.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.scripts import lerobot_record, lerobot_replay

from lerobot_excav.datasets.format.schema import dataset_features, excav_features
from lerobot_excav.envs.machines.excavator.features import STATE_NAMES
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim

pytestmark = pytest.mark.slow

SIZE = {"observation_height": 48, "observation_width": 64}
ROBOT = ["--robot.type=excavator_sim", *(f"--robot.{name}={size}" for name, size in SIZE.items())]
CAMERAS = ("main", "cab", "target_mask")

Run = Callable[..., None]


@pytest.fixture
def run(run_command: Run) -> Run:
    """Run a command on the excavator."""
    return partial(_run_on_excavator, run_command)


def _run_on_excavator(run_command: Run, main: Callable[[], None], *arguments: str) -> None:
    run_command(main, *ROBOT, *arguments)


@pytest.fixture
def record(run: Run, tmp_path: Path) -> Run:
    def _record(*arguments: str) -> None:
        flags = ["--teleop.type=excavator_operator", f"--teleop.calibration_dir={tmp_path}", "--dataset.fps=10"]
        flags += ["--dataset.single_task=dig", "--dataset.episode_time_s=1.2", "--dataset.reset_time_s=0.2"]
        flags += ["--dataset.video=false", "--dataset.push_to_hub=false", "--dataset.no_stamp=true"]
        run(lerobot_record.main, *flags, *arguments)

    return _record


def session_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "session.jsonl").read_text().splitlines()]


def dataset_of(folder: Path) -> LeRobotDataset:
    return LeRobotDataset("someone/data", root=folder / "data")


def rows_of(dataset: LeRobotDataset, episode: int) -> list[dict[str, Any]]:
    rows = [dataset[i] for i in range(len(dataset))]
    return [row for row in rows if row["episode_index"] == episode]


def image_of(row: dict[str, Any], camera: str) -> Any:
    picture = row[f"observation.images.{camera}"].permute(1, 2, 0).numpy()
    return np.round(picture * 255.0).astype(np.uint8)


def test_a_recording_is_reproduced_bit_for_bit_from_its_session_log(record: Run, tmp_path: Path) -> None:
    record("--dataset.num_episodes=2", "--robot.scene_id=3", "--robot.target_id=3", "--robot.scene_set=val")
    dataset, session = dataset_of(tmp_path), session_of(tmp_path)
    assert [(each["episode_index"], each["scene_id"], each["commands"]) for each in session] == [
        (0, 3, [[0, 3]]),
        (1, 4, [[0, 0]]),
    ]
    env = ExcavatorEnv(scene_set="val", **SIZE)
    for episode in session:
        rows = rows_of(dataset, episode["episode_index"])
        assert len(rows) == episode["frames"] > 3
        assert any(row["action"].abs().max() > 0.1 for row in rows)
        observation, _ = env.reset(options={"scene_id": episode["scene_id"], "target_id": episode["commands"][0][1]})
        for row in rows:
            assert np.array_equal(row["observation.state"].numpy(), observation["agent_pos"])
            for camera in CAMERAS:
                assert np.array_equal(image_of(row, camera), observation["pixels"][camera]), camera
            observation = env.step(row["action"].numpy())[0]
    env.close()


def test_a_recording_has_the_schema_of_scripted_data(record: Run, tmp_path: Path) -> None:
    record("--dataset.num_episodes=1")
    dataset = dataset_of(tmp_path)
    expected = dataset_features(SCOOP, height=48, width=64)
    for key in expected.keys() - excav_features(SCOOP).keys():
        recorded = dataset.features[key]
        assert recorded["dtype"] == expected[key]["dtype"], key
        assert tuple(recorded["shape"]) == tuple(expected[key]["shape"]), key
        assert recorded["names"] == expected[key]["names"], key
    assert dataset.meta.robot_type == "excavator_sim"
    assert dataset.fps == 10


def test_an_episode_recorded_again_starts_over(record: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = {"exit_early": False, "rerecord_episode": True, "stop_recording": False}  # LeRobot takes it back itself
    monkeypatch.setattr(lerobot_record, "init_keyboard_listener", lambda: (None, keys))
    record("--dataset.num_episodes=1", "--robot.target_id=2")
    dataset, (episode,) = dataset_of(tmp_path), session_of(tmp_path)
    assert (episode["episode_index"], episode["scene_id"], episode["commands"]) == (0, 0, [[0, 2]])
    assert len(dataset) == episode["frames"]
    env = ExcavatorEnv(obs_type="agent_pos")
    start, _ = env.reset(options={"scene_id": 0, "target_id": 2})
    assert np.array_equal(dataset[0]["observation.state"].numpy(), start["agent_pos"])


def test_replay_repeats_the_recorded_states(
    record: Run, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record("--dataset.num_episodes=2", "--robot.scene_id=6", "--robot.target_id=3")
    states = []
    send_action = ExcavatorSim.send_action

    def watched(robot: ExcavatorSim, action: Any) -> Any:
        observation = robot.get_observation()
        states.append(np.array([observation[name] for name in STATE_NAMES], np.float32))
        return send_action(robot, action)

    monkeypatch.setattr(ExcavatorSim, "send_action", watched)
    run(lerobot_replay.main, "--dataset.episode=1", "--robot.scene_id=7", "--robot.target_id=0")
    rows = rows_of(dataset_of(tmp_path), 1)
    assert np.array_equal(np.stack(states), np.stack([row["observation.state"].numpy() for row in rows]))
