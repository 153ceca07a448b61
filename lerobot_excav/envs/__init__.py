"""Environments. Importing this package registers their gymnasium ids and nothing else."""

import gymnasium as gym

GYM_IDS = {
    "Scoop-v0": "lerobot_excav.envs.tasks.scoop.env:ExcavatorEnv",
    "FR5Grasp-v0": "lerobot_excav.envs.tasks.grasp.env:FR5GraspEnv",
}
"""Tasks by name, and the class that plays each."""

for _task, _entry_point in GYM_IDS.items():
    # No time limit of Gymnasium's: the environment owns its length, and hands out its metrics when that is over.
    gym.register(id=f"lerobot_excav/{_task}", entry_point=_entry_point, kwargs={"task": _task})
