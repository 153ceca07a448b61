"""What only one of the simulated machines does; what they share is in tests/contract."""

from types import SimpleNamespace

import pytest
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.rollout.robot_wrapper import ThreadSafeRobot
from lerobot.rollout.strategies.core import RolloutStrategy

import lerobot_excav.plugin  # noqa: F401 - registers every --robot.type
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.errors import ConfigurationError

POSITIONS = ["swing.pos", "boom.pos", "arm.pos", "bucket.pos"]
VELOCITIES = ["swing.vel", "boom.vel", "arm.vel", "bucket.vel"]
ARM = [f"{joint}.pos" for joint in ("j1", "j2", "j3", "j4", "j5", "j6", "gripper")]


@pytest.fixture
def make_robot(tmp_path):
    """Make a robot; settings go to its configuration."""

    def _make(robot_type="fr5_sim", **settings):
        common = {"session_log": tmp_path / "session.jsonl", "calibration_dir": tmp_path}
        size = {"observation_height": 32, "observation_width": 48}
        return make_robot_from_config(RobotConfig.get_choice_class(robot_type)(**(common | size | settings)))

    return _make


def positions(robot):
    observation = robot.get_observation()
    return {name: observation[name] for name in ARM}


def swung(robot):
    """Return an action that turns the first joint away by 0.3 rad and closes the gripper."""
    start = positions(robot)
    return start | {"j1.pos": start["j1.pos"] + 0.3, "gripper.pos": 0.0}


@pytest.mark.parametrize(
    ("robot_type", "state", "action", "second_camera", "fps"),
    [
        ("excavator_sim", [*POSITIONS, *VELOCITIES], VELOCITIES, "cab", 10),
        ("fr5_sim", ARM, ARM, "top", 50),
    ],
)
def test_features_name_the_joints(make_robot, robot_type, state, action, second_camera, fps):
    robot = make_robot(robot_type)
    assert list(robot.observation_features) == [*state, "main", second_camera, "target_mask"]
    assert list(robot.action_features) == action
    assert robot.config.fps == fps


@pytest.mark.parametrize(
    ("robot_type", "own"), [("excavator_sim", {"soil": "gravel", "fidelity": "fine"}), ("fr5_sim", {})]
)
def test_settings_reach_the_environment(make_robot, robot_type, own):
    settings = {**own, "fps": 25, "scene_set": "val", "observation_height": 64, "observation_width": 48}
    env = task_of_robot(robot_type).make_env(**settings)
    expected, _ = env.reset(options={"scene_id": 2, "target_id": 1})
    with make_robot(robot_type, scene_id=2, target_id=1, **settings) as robot:
        observation = robot.get_observation()
        assert [observation[name] for name in robot.task_spec.state_names] == expected["agent_pos"].tolist()
        for camera, picture in expected["pixels"].items():
            assert (observation[camera] == picture).all(), camera
        assert {name: getattr(robot.env.settings, name) for name in settings} == settings
        assert robot.env.episode_length > 10**9
    env.close()


@pytest.mark.parametrize(
    ("robot_type", "field", "value", "allowed"),
    [
        ("excavator_sim", "soil", "lava", "sand"),
        ("excavator_sim", "fidelity", "exact", "fine"),
        ("fr5_sim", "task", "Scoop-v0", "'FR5Grasp-v0'"),
    ],
)
def test_an_impossible_value_is_named_with_what_is_allowed(make_robot, robot_type, field, value, allowed):
    with pytest.raises(ConfigurationError, match=f"robot.{field}={value!r}.*{allowed}"):
        make_robot(robot_type, **{field: value})


def test_an_episode_never_ends_by_itself(make_robot):
    with make_robot(fps=10) as robot:
        action = positions(robot)
        for _ in range(90):  # longer than the 8 s of an evaluated episode
            robot.send_action(action)
        robot.send_action(swung(robot))
        assert positions(robot)["j1.pos"] != pytest.approx(action["j1.pos"], abs=0.01)


def test_a_rollout_drives_the_arm_home_by_an_ordinary_motion(make_robot):
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
