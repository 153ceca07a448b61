"""The robot behind a wire, driven by stock LeRobot commands against the emulator."""

import json
import logging
import re
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.scripts import lerobot_rollout

import lerobot_excav.plugin  # noqa: F401 - registers the types
from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.errors import ConfigurationError, DeviceError
from lerobot_excav.robots.excavator_testbed.alignment import Ages, AlignmentLog
from lerobot_excav.robots.excavator_testbed.config_excavator_testbed import ExcavatorTestbedConfig
from lerobot_excav.robots.excavator_testbed.excavator_testbed import ExcavatorTestbed
from lerobot_excav.testbed.faulty_wire import WireFaults
from lerobot_excav.testbed.protocol import Refusal

from ..testbed.conftest import emulated, until

pytestmark = pytest.mark.slow

CHECKPOINT = Path(__file__).parents[2] / "checkpoints/excavator_mask_act"
STILL = dict.fromkeys(ACTION_NAMES, 0.0)
LEFT = {**STILL, "swing.vel": 1.0}
SIZE = {"observation_height": 96, "observation_width": 128}


def cameras_of(served, names=("main", "cab", "target_mask")):
    port = served.emulator.picture_address[1]
    cameras = {
        name: {"type": "stream", "port": port, "name": name, "fps": 10, "width": 128, "height": 96} for name in names
    }
    if served.has_depth:
        cameras["main"]["use_depth"] = True
    return cameras


@pytest.fixture
def robot(tmp_path):
    """Make a robot for a served machine, and disconnect it afterwards."""
    made = []

    def _robot(served, **settings):
        from lerobot_excav.cameras.stream_camera.config_stream_camera import StreamCameraConfig

        cameras = {
            name: StreamCameraConfig(**{key: value for key, value in camera.items() if key != "type"})
            for name, camera in cameras_of(served).items()
        }
        config = ExcavatorTestbedConfig(
            address="{}:{}".format(*served.emulator.address),
            calibration_dir=tmp_path,
            alignment_log=tmp_path / "alignment.jsonl",
            **{"cameras": cameras, **settings},
        )
        made.append(ExcavatorTestbed(config))
        return made[-1]

    yield _robot
    for each in made:
        if each.is_connected:
            each.disconnect()


def test_it_says_what_the_simulated_robot_says_and_moves(robot):
    with emulated(SIZE) as served:
        arm = robot(served)
        assert list(arm.observation_features) == [*STATE_NAMES, "main", "cab", "target_mask"]
        assert list(arm.action_features) == list(ACTION_NAMES)
        arm.connect()
        first = arm.get_observation()
        assert set(first) == set(arm.observation_features)
        assert set(np.unique(first["target_mask"])) == {0, 255}
        for _ in range(15):
            arm.send_action(LEFT)
            seen = arm.get_observation()
            arm.cameras["main"].read()  # at the rate of the pictures
        assert seen["swing.pos"] - first["swing.pos"] > 0.03


def test_what_it_sends_is_limited_and_zero_until_the_machine_is_ready_again(robot):
    with emulated(SIZE) as served:
        arm = robot(served, cameras={}, speed_limit=0.3)
        arm.connect()
        arm.get_observation()
        until(lambda: arm.get_observation() and arm.send_action(LEFT) == {**STILL, "swing.vel": pytest.approx(0.3)})
        arm.stop()
        until(lambda: arm.get_observation() and arm.send_action(LEFT) == STILL)
        arm.release()
        until(lambda: arm.get_observation() and arm.send_action(LEFT) != STILL)
        with pytest.raises(DeviceError, match=r"the action lacks boom\.vel"):
            arm.send_action({"swing.vel": 1.0})
        with pytest.raises(DeviceError, match="connected already"):
            arm.connect()
    with pytest.raises(DeviceError, match="was heard"):
        until(lambda: arm.get_observation() is None)


def test_a_machine_that_is_not_there_or_not_ready_is_an_error_in_words(robot):
    with emulated(SIZE, soak_s=60.0) as served:
        arm = robot(served, cameras={}, ready_timeout_s=1.0)
        with pytest.raises(DeviceError, match="not ready after 1 s: the soak under zero commands is not over"):
            arm.connect()
        assert not arm.is_connected
    with pytest.raises(DeviceError, match="not ready after 1 s: it is not heard"):
        arm.connect()
    for method in (arm.get_observation, arm.disconnect, arm.stop):
        with pytest.raises(DeviceError, match="is not connected"):
            method()


@pytest.mark.parametrize("before", [False, True], ids=["free at first", "latched at first"])
def test_a_stop_that_comes_while_the_robot_waits_is_not_released_by_it(robot, before):
    with emulated(SIZE, soak_s=5.0) as served:
        gate = served.emulator.gate
        gate.is_stopped = before
        arm = robot(served, cameras={}, release_stop=True, ready_timeout_s=15.0)
        trouble = []

        def connect():
            try:
                arm.connect()
            except DeviceError as error:
                trouble.append(str(error))

        thread = threading.Thread(target=connect, daemon=True)
        thread.start()
        until(lambda: arm.link is not None and arm.link.counts["heard"] > 10 and not gate.is_stopped)
        heard = arm.link.counts["heard"]
        until(lambda: arm.link.counts["heard"] > heard + 20)  # the robot has seen that it is free
        gate.is_stopped = True
        thread.join(timeout=30.0)
        assert not thread.is_alive()
        assert trouble
        assert "was stopped while the robot waited for it" in trouble[0]
        assert gate.is_stopped


def test_ages_are_those_of_the_wire(robot):
    with emulated(SIZE, wire=WireFaults(delay_ms=60.0)) as served:
        arm = robot(served)
        arm.connect()
        for _ in range(20):
            arm.cameras["main"].read()
            arm.get_observation()
            ages = arm._ages()
        assert 55.0 < ages.state_ms < 400.0
        assert 0.0 <= ages.image_ms < 400.0


@pytest.mark.parametrize(("delay_ms", "warnings"), [(0.0, 0), (100.0, 1)])
def test_a_wire_that_lets_every_command_lapse_within_its_frame_is_told_once(robot, caplog, delay_ms, warnings):
    with emulated(SIZE, wire=WireFaults(delay_ms=delay_ms)) as served:
        arm = robot(served, cameras={})
        arm.connect()
        refusals = set()
        for _ in range(30):
            arm.get_observation()
            refusals.add(arm._heard.state.refusal)
            arm.send_action(LEFT)
            time.sleep(0.1)
    told = [record.message for record in caplog.records if "stands still for a part of every frame" in record.message]
    assert len(told) == warnings
    assert Refusal.STALE in refusals or not warnings
    assert all(re.search(r"is 1\d\d ms under way", words) for words in told)


def test_frames_whose_pictures_or_state_are_too_old_are_marked(tmp_path):
    log = AlignmentLog(tmp_path / "log.jsonl")
    log.start()
    log.note(Ages(image_ms=500.0, state_ms=1.0), "NONE", is_as_told=False)  # between episodes
    log.begin(3)
    for image_ms, state_ms in ((120.0, 100.0), (120.1, 1.0), (1.0, 100.1), (None, 5.0)):
        log.note(Ages(image_ms=image_ms, state_ms=state_ms), "NONE", is_as_told=image_ms is not None)
    log.end()
    log.close()
    head, *lines = [json.loads(line) for line in log.path.read_text().splitlines()]
    assert (head["image_limit_ms"], head["state_limit_ms"]) == (120, 100)
    assert [line["is_causal"] for line in lines] == [True, False, False, True]
    assert [(line["episode_index"], line["frame_index"]) for line in lines] == [(3, frame) for frame in range(4)]
    assert [line["is_as_told"] for line in lines] == [True, True, True, False]
    assert (log.frames, log.late_frames, log.other_frames) == (4, 2, 1)
    foreign = tmp_path / "other.jsonl"
    foreign.write_text('{"event": "session"}\n')
    with pytest.raises(DeviceError, match="cannot be written"):
        AlignmentLog(foreign).start()


def test_nobody_has_to_hold_the_dead_man_on_this_computer_only():
    with pytest.raises(ConfigurationError, match=r"lets the machine at 10\.0\.0\.7 move while nobody watches"):
        ExcavatorTestbedConfig(address="10.0.0.7:47500")
    assert ExcavatorTestbedConfig(address="10.0.0.7:47500", dead_man="gamepad").host_and_port == ("10.0.0.7", 47500)


@pytest.fixture
def rollout(monkeypatch, tmp_path):
    """Run a rollout of the excavator's policy; LeRobot replaces the handlers of the root logger and of signals."""
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    signals = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)}

    def _run(served, strategy, *flags):
        cameras = str(cameras_of(served)).replace("'", "")
        robot = ["--robot.type=excavator_testbed", "--robot.address={}:{}".format(*served.emulator.address)]
        robot += [f"--robot.cameras={cameras}", f"--robot.calibration_dir={tmp_path}"]
        robot += [f"--robot.alignment_log={tmp_path / 'alignment.jsonl'}"]
        policy = [f"--policy.path={CHECKPOINT}", "--policy.device=cpu", "--policy.n_action_steps=5"]
        common = ["--fps=10", "--play_sounds=false", "--return_to_initial_position=false"]
        monkeypatch.setattr(sys, "argv", ["command", f"--strategy.type={strategy}", *robot, *policy, *common, *flags])
        lerobot_rollout.main()

    yield _run
    root.setLevel(level)
    root.handlers[:] = handlers
    for each, handler in signals.items():
        signal.signal(each, handler)


@pytest.mark.parametrize("has_depth", [False, True])
def test_the_trained_policy_drives_it_and_every_recorded_frame_has_its_ages(rollout, tmp_path, has_depth):
    """Also where the machine has depth, of which the policy knows nothing."""
    values = {"repo_id": "someone/rollout_testbed", "root": tmp_path / "data", "single_task": "dig", "fps": 10}
    values |= {"video": "false", "push_to_hub": "false", "no_stamp": "true"}
    values |= {"num_episodes": 1, "episode_time_s": 4, "reset_time_s": 0}
    with emulated({**SIZE, "scene_set": "val"}, has_depth=has_depth) as served:
        before = served.site._env.world.machine.joint_pos
        rollout(served, "episodic", *(f"--dataset.{name}={value}" for name, value in values.items()))
        moved = np.abs(served.site._env.world.machine.joint_pos - before)
    assert moved.max() > 0.1
    dataset = LeRobotDataset("someone/rollout_testbed", root=tmp_path / "data")
    lines = [json.loads(line) for line in (tmp_path / "alignment.jsonl").read_text().splitlines()][1:]
    assert [line["frame_index"] for line in lines] == list(range(len(dataset)))
    assert dataset[0]["observation.state"].shape == (8,)
    assert ("observation.images.main_depth" in dataset.features) == has_depth
    assert all(line["image_age_ms"] >= 0.0 and line["state_age_ms"] >= 0.0 for line in lines)
