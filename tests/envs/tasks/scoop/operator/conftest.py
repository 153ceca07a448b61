"""The scripted operator at work, for its tests."""

import numpy as np

from lerobot_excav.envs.tasks.scoop.operator import DigOperator


def drive(env, *, scene_id, target_id, seed):
    """Let the operator dig a target; return its actions (n, 4), its phases, and the metrics of the episode."""
    env.reset(options={"scene_id": scene_id, "target_id": target_id})
    operator = DigOperator(rng=np.random.default_rng(seed))
    operator.reset(env)
    actions, phases, over = [], [], False
    while not over:
        actions.append(operator.act(env))
        phases.append(operator.phase)
        _, _, terminated, truncated, info = env.step(actions[-1])
        over = terminated or truncated
    return np.array(actions), phases, info["episode_metrics"]
