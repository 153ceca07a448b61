"""lerobot-rollout with the trained policy of the arm, run for real: what each strategy records, and what it logs.

These tests would notice if a new version of LeRobot announced its phases in other words, or named the fields of its
configuration otherwise.
"""

import logging
import signal
import sys
from pathlib import Path

import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.rollout.strategies import dagger, highlight, sentry
from lerobot.scripts import lerobot_rollout

from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.robots.simulated_robot import SimulatedRobot
from lerobot_excav.scripts import main

pytestmark = pytest.mark.slow

CHECKPOINT = Path(__file__).parents[2] / "checkpoints/fr5_grasp_mask_act"


@pytest.fixture
def rollout(monkeypatch, tmp_path):
    """Run a rollout; keys are pressed before the actions of these numbers, and it is interrupted before the last."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    signals = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)}
    press = []

    def listen(dispatch, **_):
        press.append(dispatch)

    for module in (highlight, dagger):
        monkeypatch.setattr(module, "create_key_listener", listen)

    def _run(strategy, *flags, keys=(), actions=10**9):
        count, send_action = 0, SimulatedRobot.send_action

        def watched(robot, action):
            nonlocal count
            if count == actions:
                raise KeyboardInterrupt
            if count in dict(keys):
                press[-1](dict(keys)[count])
            count += 1
            return send_action(robot, action)

        monkeypatch.setattr(SimulatedRobot, "send_action", watched)
        folders = [f"--robot.calibration_dir={tmp_path}", f"--robot.session_log={tmp_path / 'session.jsonl'}"]
        policy = [f"--policy.path={CHECKPOINT}", "--policy.device=cpu", "--return_to_initial_position=false"]
        common = ["--robot.type=fr5_sim", "--fps=50", "--play_sounds=false", *folders, *policy]
        monkeypatch.setattr(sys, "argv", ["command", f"--strategy.type={strategy}", *common, *flags])
        lerobot_rollout.main()
        return count

    yield _run
    # LeRobot's commands replace the handlers of the root logger and of signals.
    root.setLevel(level)
    root.handlers[:] = handlers
    for each, handler in signals.items():
        signal.signal(each, handler)


def recording(tmp_path, **changes):
    """The flags of a recording."""
    values = {"repo_id": "someone/rollout_data", "root": tmp_path / "data", "single_task": "go", "fps": 50}
    values |= {"video": "false", "push_to_hub": "false", "no_stamp": "true", **changes}
    return [f"--dataset.{name}={value}" for name, value in values.items()]


def lengths_of(tmp_path):
    dataset = LeRobotDataset("someone/rollout_data", root=tmp_path / "data")
    return [int(length) for length in dataset.meta.episodes["length"]]


def logged(tmp_path):
    path = tmp_path / "session.jsonl"
    return list(read_session(path).values()) if path.exists() else []


def assert_completed(tmp_path):
    """The session log describes every episode, so its columns can be added."""
    lengths = lengths_of(tmp_path)
    episodes = logged(tmp_path)[: len(lengths)]
    assert [episode.frames for episode in episodes] == lengths
    assert [episode.pair.target_id for episode in episodes] == [index % 4 for index in range(len(lengths))]
    assert main.main(["index", str(tmp_path / "data"), f"--session={tmp_path / 'session.jsonl'}"]) == 0


def test_base_drives_the_robot_and_records_nothing(rollout, tmp_path):
    assert rollout("base", "--duration=0.3", actions=5) in range(1, 6)
    assert logged(tmp_path) == []


def test_episodic_records_with_a_session_log(rollout, tmp_path):
    rollout("episodic", *recording(tmp_path, num_episodes=2, episode_time_s=0.2, reset_time_s=0))
    assert len(lengths_of(tmp_path)) == 2
    assert_completed(tmp_path)


def test_sentry_records_with_a_session_log_and_starts_afresh_at_every_cut(rollout, tmp_path, monkeypatch):
    monkeypatch.setattr(sentry, "estimate_max_episode_seconds", lambda *_, **__: 0.1)
    rollout("sentry", *recording(tmp_path), actions=12)
    assert len(lengths_of(tmp_path)) > 1
    assert sum(lengths_of(tmp_path)) == 12
    assert_completed(tmp_path)


def test_highlight_records_what_it_is_told_to_and_says_that_it_leaves_no_session_log(rollout, tmp_path, capfd):
    rollout("highlight", *recording(tmp_path), keys=[(3, "s"), (6, "s")], actions=9)
    assert lengths_of(tmp_path) == [7]
    assert logged(tmp_path) == []
    assert "--strategy.type=highlight begins its episodes within a run" in capfd.readouterr().err


@pytest.mark.parametrize("autonomous", [False, True])
def test_dagger_records_corrections_and_says_that_it_leaves_no_session_log(rollout, tmp_path, capfd, autonomous):
    teleop = ["--teleop.type=fr5_operator", f"--teleop.calibration_dir={tmp_path}", "--strategy.smooth_handover=false"]
    record = [f"--strategy.record_autonomous={str(autonomous).lower()}", "--strategy.num_episodes=1"]
    keys = [(2, "space"), (4, "tab"), (7, "tab"), (9, "space")]
    rollout("dagger", *teleop, *record, *recording(tmp_path), keys=keys, actions=11)
    dataset = LeRobotDataset("someone/rollout_data", root=tmp_path / "data")
    corrected = [bool(row["intervention"]) for row in (dataset[i] for i in range(len(dataset)))]
    assert sum(corrected) == 3
    assert all(corrected) != autonomous
    assert logged(tmp_path) == []
    assert "--strategy.type=dagger begins its episodes within a run" in capfd.readouterr().err


def test_a_rollout_with_lerobots_own_defaults_is_refused_before_its_folder_is_made(rollout, tmp_path):
    flags = recording(tmp_path, fps=30, video="true")
    with pytest.raises(ValueError, match=r"Give --dataset\.fps=50 --dataset\.video=false"):
        rollout("episodic", *flags)
    assert not (tmp_path / "data").exists()


def test_real_time_chunking_is_refused_by_lerobot(rollout):
    with pytest.raises(ValueError, match="RTC inference is not supported by policy type 'mask_act'"):
        rollout("base", "--duration=0.3", "--inference.type=rtc")
