"""What a step needs is compiled before `reset` returns.

Not part of the default run, for it compiles everything: two minutes.
"""

import os
import subprocess
import sys

import pytest

FIRST_EPISODE = """
import sys
import numpy as np
from numba.core import event
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator

names = []

class Recorder(event.Listener):
    def on_start(self, event):
        names.append(event.data["dispatcher"].__name__)

    def on_end(self, event):
        pass

env, operator = ExcavatorEnv(obs_type=sys.argv[1]), DigOperator(rng=np.random.default_rng(5))
env.reset(options={"scene_id": 7, "target_id": 3})
operator.reset(env)
event.register("numba:compile", Recorder())
over = False
while not over:
    *_, terminated, truncated, info = env.step(operator.act(env))
    over = terminated or truncated
env.reset(options={"scene_id": 8, "target_id": 0})
for _ in range(30 if sys.argv[1] == "agent_pos" else 3):  # with the lowered bucket into the box
    env.step(np.array([1.0, -1.0, 0.0, 0.0], np.float32))
print(info["task_state"][2] > 100.0, names)
"""


def first_episode(cache, obs_type):
    environment = {"NUMBA_CACHE_DIR": str(cache), "MUJOCO_GL": "egl", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", FIRST_EPISODE, obs_type]
    return subprocess.run(command, env={**os.environ, **environment}, text=True, capture_output=True, check=True)


@pytest.mark.slow
def test_after_the_first_reset_nothing_is_compiled_and_the_second_start_is_quiet(tmp_path):
    first = first_episode(tmp_path, "agent_pos")
    assert first.stdout == "True []\n"
    assert first.stderr.startswith("Compiling the simulation: about a minute, this once ...\nCompiled in ")
    second = first_episode(tmp_path, "pixels_agent_pos")
    assert second.stdout == "True []\n"
    assert "Compil" not in second.stderr
