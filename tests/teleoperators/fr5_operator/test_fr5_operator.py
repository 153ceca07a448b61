"""What only the arm's scripted operator does; what it shares with others is in tests/contract."""

import numpy as np

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator import GraspOperator
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.fr5_sim.fr5_sim import FR5Sim
from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.fr5_operator.fr5_operator import FR5Operator

SIZE = {"observation_height": 32, "observation_width": 32}


def test_it_acts_as_the_scripted_operator_in_the_environment(tmp_path):
    operator = FR5Operator(FR5OperatorConfig(calibration_dir=tmp_path, seed=3))
    operator.connect()
    robot = FR5Sim(FR5SimConfig(calibration_dir=tmp_path, scene_id=1, target_id=2, **SIZE))
    driven = []
    with robot:
        for _ in range(100):
            driven.append(operator.get_action())
            robot.send_action(driven[-1])
    env = FR5GraspEnv(**SIZE)
    env.reset(options={"scene_id": 1, "target_id": 2})
    script = GraspOperator(rng=np.random.default_rng((3, 1, 2)))
    script.reset(env)
    for action in driven:
        expected = script.act(env)
        assert np.array_equal(np.float32(list(action.values())), expected)
        env.step(expected)
    env.close()


def test_it_puts_the_commanded_block_into_the_tray(tmp_path):
    operator = FR5Operator(FR5OperatorConfig(calibration_dir=tmp_path))
    operator.connect()
    robot = FR5Sim(FR5SimConfig(calibration_dir=tmp_path, scene_id=4, target_id=3, fps=25, **SIZE))
    with robot:
        for _ in range(200):
            robot.send_action(operator.get_action())
        assert robot.env.grasp.is_success
