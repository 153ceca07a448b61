"""LeRobot's commands and `lerobot-excav index`, run for real with the scripted operators.

These tests would notice if a new version of LeRobot announced the phases of a recording in other words.
"""

import logging

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.scripts import lerobot_record, lerobot_replay

from lerobot_excav.datasets.complete.recovery import recover_recording
from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.datasets.format.schema import dataset_features, excav_features
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.robots.simulated_robot import SimulatedRobot
from lerobot_excav.scripts import main

pytestmark = pytest.mark.slow

SIZE = {"observation_height": 48, "observation_width": 64}
# Settings of the robot, and how long an episode lasts [s]; the arm's command changes within each.
ROBOTS = {"excavator_sim": ({}, 1.2), "fr5_sim": ({"retarget_frame": 3}, 0.6)}


def flags(kind, values):
    return [f"--{kind}.{name}={value}" for name, value in values.items()]


@pytest.fixture
def record(run_command, tmp_path):
    """Record with a robot's scripted operator; return the dataset and the episodes of the session."""

    def _record(robot_type, episodes, *, resume=False, **robot):
        operator = robot_type.replace("sim", "operator")
        settings, seconds = ROBOTS[robot_type]
        dataset = {"fps": task_of_robot(robot_type).make_settings().fps, "num_episodes": episodes, "single_task": "go"}
        dataset |= {"episode_time_s": seconds, "reset_time_s": 0.2}
        dataset |= {"video": "false", "push_to_hub": "false", "no_stamp": "true"}
        run_command(
            lerobot_record.main,
            *flags("robot", {"type": robot_type, **SIZE, **settings, **robot}),
            *flags("teleop", {"type": operator, "calibration_dir": tmp_path}),
            *flags("dataset", dataset),
            f"--resume={str(resume).lower()}",
        )
        return dataset_of(tmp_path), list(read_session(tmp_path / "session.jsonl").values())

    return _record


def dataset_of(folder):
    return LeRobotDataset("someone/data", root=folder / "data")


def rows_of(dataset, episode):
    return [row for row in (dataset[i] for i in range(len(dataset))) if row["episode_index"] == episode]


def image_of(row, camera):
    return np.round(row[f"observation.images.{camera}"].permute(1, 2, 0).numpy() * 255.0).astype(np.uint8)


def assert_played_alike(env, episode, rows):
    """Play the recorded actions in an environment: states and pictures come out bit for bit."""
    assert len(rows) == episode.frames > 3
    assert any((row["action"] - rows[0]["action"]).abs().max() > 0.0 for row in rows)
    observation, _ = env.reset(options={"scene_id": episode.pair.scene_id, "target_id": episode.pair.target_id})
    for row, frame in zip(rows, episode.runs[0].frames, strict=True):
        # What the log holds is what LeRobot recorded, bit for bit.
        assert np.array_equal(row["action"].numpy(), np.array(frame.action, np.float32))
        assert np.array_equal(row["observation.state"].numpy(), np.array(frame.state, np.float32))
        assert np.array_equal(row["observation.state"].numpy(), observation["agent_pos"])
        for camera, picture in observation["pixels"].items():
            assert np.array_equal(image_of(row, camera), picture), camera
        observation = env.step(row["action"].numpy())[0]


def assert_equal(found, expected):
    assert len(found) == len(expected)
    for a, b in zip((found[i] for i in range(len(found))), (expected[i] for i in range(len(expected))), strict=True):
        assert a.keys() == b.keys()
        for key, value in b.items():
            assert np.array_equal(np.asarray(a[key]), np.asarray(value)), key


def assert_schema_of_scripted_data(dataset, spec):
    expected = dataset_features(spec, height=48, width=64)
    for key in expected.keys() - excav_features(spec).keys():
        recorded = dataset.features[key]
        assert recorded["dtype"] == expected[key]["dtype"], key
        assert tuple(recorded["shape"]) == expected[key]["shape"], key
        assert recorded["names"] == expected[key]["names"], key
    assert dataset.meta.robot_type == spec.robot_type


@pytest.mark.parametrize("robot_type", ROBOTS)
def test_a_recording_is_repeated_from_its_session_log_completed_and_replayed_bit_for_bit(
    robot_type, record, run_command, tmp_path, monkeypatch
):
    spec, settings = task_of_robot(robot_type), ROBOTS[robot_type][0]
    dataset, session = record(robot_type, 2, scene_set="val", scene_id=6, target_id=3)
    starts = [(each.episode_index, each.pair.uid) for each in session]
    assert starts == [(0, f"{spec.env_type}/val/6/0/3"), (1, f"{spec.env_type}/val/7/0/0")]
    assert_schema_of_scripted_data(dataset, spec)
    env = spec.make_env(scene_set="val", **SIZE, **settings)
    for episode in session:
        assert_played_alike(env, episode, rows_of(dataset, episode.episode_index))
    env.close()
    # Recovered from the log, the dataset is the same, text and pictures included.
    result = recover_recording(tmp_path / "data", tmp_path / "session.jsonl", out=tmp_path / "recovered")
    assert_equal(LeRobotDataset("someone/data", root=result.root), dataset)

    assert main.main(["index", str(tmp_path / "data"), f"--session={tmp_path / 'session.jsonl'}"]) == 0
    assert main.main(["qc", str(tmp_path / "data"), "--replays=2"]) == 0
    rows = rows_of(dataset_of(tmp_path), 1)
    assert rows[0]["excav.pair_uid"] == f"{spec.env_type}/val/7/0/0"
    frames, targets = np.transpose([(0, session[1].pair.target_id), *session[1].schedule])
    assert frames.tolist() == [0, *settings.values()]
    shown = np.repeat(targets, np.diff([*frames, len(rows)]))
    assert [int(row["excav.target_id"]) for row in rows] == shown.tolist()

    states = []
    send_action = SimulatedRobot.send_action

    def watched(robot, action):
        observation = robot.get_observation()
        states.append(np.array([observation[name] for name in spec.state_names], np.float32))
        return send_action(robot, action)

    monkeypatch.setattr(SimulatedRobot, "send_action", watched)
    where = {"type": robot_type, **SIZE, **settings, "scene_set": "val", "scene_id": 7, "target_id": 0}
    run_command(lerobot_replay.main, *flags("robot", where), "--dataset.episode=1")
    assert np.array_equal(np.stack(states), np.stack([row["observation.state"].numpy() for row in rows]))


def test_an_episode_recorded_again_starts_over(record, monkeypatch):
    keys = {"exit_early": False, "rerecord_episode": True, "stop_recording": False}  # LeRobot takes it back itself
    monkeypatch.setattr(lerobot_record, "init_keyboard_listener", lambda: (None, keys))
    dataset, (episode,) = record("excavator_sim", 1, target_id=2)
    assert (episode.episode_index, episode.pair.scene_id, episode.pair.target_id) == (0, 0, 2)
    assert len(dataset) == episode.frames
    env = task_of_robot("excavator_sim").make_env(obs_type="agent_pos")
    start, _ = env.reset(options={"scene_id": 0, "target_id": 2})
    assert np.array_equal(dataset[0]["observation.state"].numpy(), start["agent_pos"])


def test_a_resumed_recording_goes_on_behind_the_last_pair(record, tmp_path):
    for resume in (False, True):
        dataset, session = record("fr5_sim", 1, resume=resume, target_id=2)
    assert [each.pair.target_id for each in session] == [2, 3]
    assert dataset.meta.total_episodes == 2
    # Without the log of the first session nothing is recorded, and what is there stays readable.
    with pytest.raises(ConfigurationError, match=r"has 2 episodes already.*--robot\.session_log=FILE"):
        record("fr5_sim", 1, resume=True, target_id=2, session_log=tmp_path / "another.jsonl")
    assert dataset_of(tmp_path).meta.total_episodes == 2
    assert main.main(["index", str(tmp_path / "data"), f"--session={tmp_path / 'session.jsonl'}"]) == 0


def test_an_episode_that_was_restarted_is_recovered_frame_by_frame(tmp_path):
    settings = {"observation_height": 48, "observation_width": 64, "calibration_dir": tmp_path, "fps": 10}
    robot = ExcavatorSim(ExcavatorSimConfig(**settings, session_log=tmp_path / "session.jsonl"))
    root = logging.getLogger()
    level = root.level
    root.setLevel(logging.INFO)
    robot.connect()
    try:
        logging.info("Recording episode 0")
        seen = []
        for number in range(9):
            action = dict.fromkeys(robot.action_features, 0.9 - 0.2 * number)
            seen.append((robot.get_observation(), list(action.values())))
            robot.send_action(action | {"next_scene": float(number == 2), "reinitialise": float(number == 6)})
        logging.info("Reset the environment")
    finally:
        robot.disconnect()
        root.setLevel(level)
    (tmp_path / "data" / "meta").mkdir(parents=True)  # all that a crash at the first saving may leave
    recover_recording(tmp_path / "data", tmp_path / "session.jsonl", task="go")
    for row, (observation, action) in zip(rows_of(dataset_of(tmp_path), 0), seen, strict=True):
        assert np.array_equal(row["action"].numpy(), np.array(action, np.float32))
        state = [observation[name] for name in robot.task_spec.state_names]
        assert np.array_equal(row["observation.state"].numpy(), np.array(state, np.float32))
        for camera in robot.cameras:
            assert np.array_equal(image_of(row, camera), observation[camera]), camera
