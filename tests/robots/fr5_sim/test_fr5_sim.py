"""What only the simulated arm does; what it shares with other robots is in tests/contract."""

from types import SimpleNamespace

import numpy as np
import pytest
from lerobot.rollout.robot_wrapper import ThreadSafeRobot
from lerobot.rollout.strategies.core import RolloutStrategy

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.fr5_sim.fr5_sim import FR5Sim

NAMES = ("j1.pos", "j2.pos", "j3.pos", "j4.pos", "j5.pos", "j6.pos", "gripper.pos")


@pytest.fixture
def make_robot(tmp_path):
    """Make a robot; settings go to its configuration."""

    def _make(**settings):
        common = {"session_log": tmp_path / "session.jsonl", "calibration_dir": tmp_path}
        size = {"observation_height": 32, "observation_width": 48}
        return FR5Sim(FR5SimConfig(**(common | size | settings)))

    return _make


def positions(robot):
    observation = robot.get_observation()
    return {name: observation[name] for name in NAMES}


def swung(robot):
    """Return an action that turns the first joint away by 0.3 rad and closes the gripper."""
    start = positions(robot)
    return start | {"j1.pos": start["j1.pos"] + 0.3, "gripper.pos": 0.0}


def test_features_name_six_joints_and_the_gripper(make_robot):
    robot = make_robot()
    assert list(robot.observation_features) == [*NAMES, "main", "top", "target_mask"]
    assert list(robot.action_features) == list(NAMES)
    assert robot.config.fps == 50


def test_settings_reach_the_environment(make_robot):
    env = FR5GraspEnv(scene_set="val", fps=25, observation_height=64, observation_width=48)
    expected, _ = env.reset(options={"scene_id": 2, "target_id": 1})
    with make_robot(fps=25, scene_set="val", scene_id=2, target_id=1, observation_height=64) as robot:
        observation = robot.get_observation()
        assert list(positions(robot).values()) == expected["agent_pos"].tolist()
        for camera in robot.cameras:
            assert np.array_equal(observation[camera], expected["pixels"][camera]), camera
        assert robot.env.fps == 25
    env.close()


def test_an_episode_never_ends_by_itself(make_robot):
    with make_robot(fps=10) as robot:
        action = positions(robot)
        for _ in range(90):  # longer than the 8 s of an evaluated episode
            robot.send_action(action)
        robot.send_action(swung(robot))
        assert positions(robot)["j1.pos"] != pytest.approx(action["j1.pos"], abs=0.01)


def test_a_rollout_drives_it_home_by_an_ordinary_motion(make_robot):
    with make_robot() as robot:
        home, episodes = positions(robot), robot.episode_count
        away = swung(robot)
        for _ in range(40):
            robot.send_action(away)
        blocks = robot.env.workcell.block_pos_w
        hardware = SimpleNamespace(robot_wrapper=ThreadSafeRobot(robot), initial_position=home)
        RolloutStrategy._return_to_initial_position(hardware, duration_s=0.6)
        assert robot.episode_count == episodes
        assert robot.env.workcell.block_pos_w == pytest.approx(blocks, abs=1e-4)
        # The servos trail the last command of the motion.
        assert list(positions(robot).values()) == pytest.approx(list(home.values()), abs=0.2)
        assert abs(positions(robot)["j1.pos"] - home["j1.pos"]) < 0.5 * 0.3


@pytest.mark.parametrize("task", ["Dance-v0", "Scoop-v0"])
def test_a_task_of_another_machine_is_refused(make_robot, task):
    with pytest.raises(ConfigurationError, match=rf"robot\.task='{task}'.*'FR5Grasp-v0'"):
        make_robot(task=task)
