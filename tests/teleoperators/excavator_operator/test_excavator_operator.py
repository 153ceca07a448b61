"""What only the excavator's scripted operator does; what it shares with others is in tests/contract."""

import numpy as np

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_operator.excavator_operator import ExcavatorOperator


def test_it_acts_as_the_scripted_operator_in_the_environment(tmp_path):
    operator = ExcavatorOperator(ExcavatorOperatorConfig(calibration_dir=tmp_path, seed=3))
    operator.connect()
    env = ExcavatorEnv(obs_type="agent_pos")
    env.reset(options={"scene_id": 1, "target_id": 2})
    script = DigOperator(rng=np.random.default_rng((3, 1, 2)))
    script.reset(env)
    size = {"observation_height": 32, "observation_width": 32}
    driven = []
    with ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, scene_id=1, target_id=2, **size)) as robot:
        for _ in range(25):
            action, expected = operator.get_action(), script.act(env)
            driven.append(list(action.values()))
            assert driven[-1] == expected.tolist()
            robot.send_action(action)
            env.step(expected)
    assert np.abs(driven).max() > 0.1
