"""Every scripted operator drives its robot as it drives the environment; what else it does is in tests/contract."""

import numpy as np
import pytest
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import make_teleoperator_from_config
from lerobot.teleoperators.config import TeleoperatorConfig

import lerobot_excav.plugin  # noqa: F401 - registers every type
from lerobot_excav.envs.tasks.registry import task_of_robot

SIZE = {"observation_height": 32, "observation_width": 32}


@pytest.mark.parametrize(
    ("machine", "scene_id", "target_id", "fps", "frames", "success"),
    [("excavator", 1, 2, 10, 25, False), ("fr5", 4, 3, 25, 200, True)],
)
def test_it_acts_as_the_script_in_the_environment(machine, scene_id, target_id, fps, frames, success, tmp_path):
    config = TeleoperatorConfig.get_choice_class(f"{machine}_operator")(calibration_dir=tmp_path, seed=3)
    operator = make_teleoperator_from_config(config)
    operator.connect()
    start = {"scene_id": scene_id, "target_id": target_id}
    spec = task_of_robot(f"{machine}_sim")
    env = spec.make_env(obs_type="agent_pos", fps=fps)
    env.reset(options=start)
    script = spec.make_operator(np.random.default_rng((3, scene_id, target_id)))
    script.reset(env)
    config = RobotConfig.get_choice_class(spec.robot_type)(calibration_dir=tmp_path, fps=fps, **start, **SIZE)
    with make_robot_from_config(config) as robot:
        driven = []
        for _ in range(frames):
            action, expected = operator.get_action(), script.act(env)
            driven.append(np.float32(list(action.values())))
            assert np.array_equal(driven[-1], expected)
            robot.send_action(action)
            info = env.step(expected)[-1]
    assert np.ptp(driven, axis=0).max() > 0.1
    assert info["is_success"] == success
