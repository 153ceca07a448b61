"""What only the arm's scripted operator does; what it shares with others is in tests/contract."""

import numpy as np

from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.grasp.operator import GraspOperator
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.fr5_sim.fr5_sim import FR5Sim
from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.fr5_operator.fr5_operator import FR5Operator

SIZE = {"observation_height": 32, "observation_width": 32}


def test_it_acts_as_the_scripted_operator_in_the_environment_and_puts_the_block_into_the_tray(tmp_path):
    operator = FR5Operator(FR5OperatorConfig(calibration_dir=tmp_path, seed=3))
    operator.connect()
    env = FR5GraspEnv(obs_type="agent_pos", fps=25)
    env.reset(options={"scene_id": 4, "target_id": 3})
    script = GraspOperator(rng=np.random.default_rng((3, 4, 3)))
    script.reset(env)
    with FR5Sim(FR5SimConfig(calibration_dir=tmp_path, scene_id=4, target_id=3, fps=25, **SIZE)) as robot:
        for _ in range(200):
            action, expected = operator.get_action(), script.act(env)
            assert np.array_equal(np.float32(list(action.values())), expected)
            robot.send_action(action)
            env.step(expected)
        assert robot.env.grasp.is_success
